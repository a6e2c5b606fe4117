"""Reports: one section a module and a template, one self-contained HTML file."""
