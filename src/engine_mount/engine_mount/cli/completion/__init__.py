"""What the shell offers behind Tab: values by name, without loading what would take long."""
