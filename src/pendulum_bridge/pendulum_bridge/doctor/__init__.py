"""The answer to 'it does not connect': checks of a rig's wire, signs, zero and limits, each with what to do."""
