"""Says what is wrong with the configuration."""

import re

# Of jsonschema's text: the fault, the schema, and where in the configuration it is.
FAULT = re.compile(r"(?:.*\n)?\w+: (.+)")
PLACE = re.compile(r"^On instance\['(\w+)'\]:", re.MULTILINE)


def configuration_fault(text):
    """The fault alone, with its field, of an error of `snakemake.utils.validate`, whose text has the schema as well."""
    fault, place = FAULT.match(text), PLACE.search(text)
    field = f"{place[1]}: " if place else ""
    return f"configuration: {field}{fault[1] if fault else text}; docs/cluster.md has the fields and their values"
