"""What a picture is made of, before any graphics library draws it."""
