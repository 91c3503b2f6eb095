"""What the columns of a text file of unknown layout hold: names, numbers, units."""
