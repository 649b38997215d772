"""The report's sections: each module gives one frozen context, and the figures drawn from it."""
