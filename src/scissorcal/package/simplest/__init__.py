"""The simplest law that a scene needs: projection onto simpler candidates, and the walk."""
