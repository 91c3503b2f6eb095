"""`python -m sinssim` is the command line."""

from sinssim.cli import program

if __name__ == "__main__":
    program()
