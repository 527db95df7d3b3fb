"""What accuracy costs in soft-tissue simulation."""
