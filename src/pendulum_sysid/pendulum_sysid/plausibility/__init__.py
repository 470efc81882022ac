"""Ask before any search whether a recording can be one of its twin's rig."""
