"""The textbook's algorithms and matrices as it writes them, for teaching and as references."""
