"""The planar elastica as a model (`compare.models.elastica.model.ElasticaModel`)."""
