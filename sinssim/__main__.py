"""`python -m sinssim` is the command line."""

from sinssim.cli import main

if __name__ == "__main__":
    main()
