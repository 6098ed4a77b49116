"""Files of others as named columns, one module for each format."""
