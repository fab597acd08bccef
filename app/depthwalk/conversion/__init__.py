"""Turn scenes of other programs into scene files."""
