"""Prints, for each scene of a file, what its JSON schema has against it: a list of texts, empty where it is valid."""

import json
import sys

import jsonschema

with open(sys.argv[1]) as file:
    question = json.load(file)
kind = jsonschema.validators.validator_for(question["schema"])
kind.check_schema(question["schema"])
validator = kind(question["schema"])
complaints = []
for scene in question["scenes"]:
    error = jsonschema.exceptions.best_match(validator.iter_errors(scene))
    complaints.append(f"{error.json_path}: {error.message}" if error else "")
json.dump(complaints, sys.stdout)
