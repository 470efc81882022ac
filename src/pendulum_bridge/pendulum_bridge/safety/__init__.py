"""What is sent to the rig and why: every safety decision, pure, without clock, socket or topic."""
