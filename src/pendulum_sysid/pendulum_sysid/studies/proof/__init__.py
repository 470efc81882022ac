"""The proof: physics is concealed in emulated rigs, diagnosed blindly, and compared with the seal.

A trial is one recording of an emulated rig with wrong constants and concealed effects. Its seal
holds the truth. The diagnosis and its rivals see the recording and the nominal twin only.
"""
