"""`python -m farm_ar` is `farm-ar`."""

from farm_ar.cli import main

if __name__ == "__main__":
    main()
