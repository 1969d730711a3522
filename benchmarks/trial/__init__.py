"""Trials of discovery: effects hidden in twin data of random rigs, found blind, and counted."""
