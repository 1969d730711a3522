"""Public functions that need several internal modules; `import muscle_bayes` offers them all."""
