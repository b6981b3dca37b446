"""The curve-angle rod as a model (`compare.models.curve_angle.model.CurveAngleModel`)."""
