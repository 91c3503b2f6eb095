"""Parts of the studies beside this folder: theory, figures and recordings that only they need."""
