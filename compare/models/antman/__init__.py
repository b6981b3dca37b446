"""The shearable, extensible rod as a model (`compare.models.antman.model.AntmanModel`)."""
