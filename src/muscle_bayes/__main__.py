"""`python -m muscle_bayes`: the command line where `muscle-bayes` is not on the path."""

from muscle_bayes.cli import main

if __name__ == "__main__":
    main()
