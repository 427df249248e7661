"""Re-identification as a service, and the Python client of it; needs the extra `service`."""
