"""The tape spring as a model (`compare.models.tape.model.TapeModel`)."""
