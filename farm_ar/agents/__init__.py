"""Players of the environments, attacks on re-identifiers, certificates, and the stress test made of them."""
