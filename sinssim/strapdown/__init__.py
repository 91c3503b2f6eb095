"""The strapdown engine: navigation from increments with interchangeable attitude algorithms."""
