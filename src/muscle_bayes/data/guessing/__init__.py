"""What a log's file tells of its own layout, columns and units, for `muscle-bayes init`."""
