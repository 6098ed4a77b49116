"""Text tables in every dialect: what separates cells, which decimal sign, where names and units stand."""
