"""What a formula is made of: its words, its trees, and the way from a user's input to them and back to text."""
