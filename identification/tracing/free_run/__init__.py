"""Which effects the free run calls for: added, exchanged, taken out."""
