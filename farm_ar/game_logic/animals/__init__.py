"""The animals: the routes on which they run, and who arrives where and when."""
