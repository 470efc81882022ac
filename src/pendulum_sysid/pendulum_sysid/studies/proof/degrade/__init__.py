"""How a diagnosis answers recordings that computers and sensors have degraded."""
