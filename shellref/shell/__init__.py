"""The Naghdi shell: strip, supports, material, strains. See `shellref.path` for how it is solved."""
