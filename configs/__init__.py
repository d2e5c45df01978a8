"""Experiment configurations: `train.yaml` and one file an experiment in `config/`, chosen by `config=NAME`."""
