"""Where worlds come from: generators, file formats, suites, padding."""
