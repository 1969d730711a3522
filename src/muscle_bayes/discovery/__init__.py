"""Discovery: where model and measurement disagree, which effect is missing, and what adding it does."""
