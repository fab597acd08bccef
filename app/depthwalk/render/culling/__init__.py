"""Leave out objects that are hidden behind what is drawn already."""
