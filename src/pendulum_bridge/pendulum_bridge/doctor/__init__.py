"""The doctor: checks of a rig's wire, signs, zeros and limits, each with what to do."""
