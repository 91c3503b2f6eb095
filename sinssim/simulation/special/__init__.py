"""Systems that navigate in a special way, one file each; `navigation.SPECIAL` lists them."""
