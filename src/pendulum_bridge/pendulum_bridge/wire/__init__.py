"""The rig's packets and how they travel: UDP, TCP, and the time of their arrival."""
