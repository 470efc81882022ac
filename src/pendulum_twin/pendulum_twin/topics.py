"""Name the topics and services, the joints in their order, and the signs of twin and rig.

Names are relative, so that `twin` and `rig` run side by side in their namespaces. Signs (thesis,
section 5.2): the cart's position is positive along the rail, 0 in its middle; the pole's angle is
0 upright, counterclockwise positive, pi when hanging, and never wrapped. A positive command pushes
the cart the positive way.
"""

# sensor_msgs/JointState: position [m, rad], velocity [m/s, rad/s]; stamp: sampling time
JOINT_STATES = "joint_states"
PWM = "pwm"  # std_msgs/Float64: PWM fraction, as commanded
APPLIED_PWM = "applied_pwm"  # std_msgs/Float64: what was really sent, after limits
# std_msgs/Float64, transient local: the largest command that rig or twin takes; inf for no limit
PWM_LIMIT = "pwm_limit"
# std_srvs/Trigger: returns when the pendulum hangs at rest in the middle of the rail, or why not
RESET = "reset"
STOP, CLEAR_STOP = "stop", "clear_stop"  # std_srvs/Trigger: the latching emergency stop
STOPPED = "stopped"  # std_msgs/Bool, transient local: whether the stop is latched
# std_msgs/String, transient local: how the plan under way, or the last, stands (excitation_node)
OUTCOME = "outcome"
PROGRESS = "progress"  # std_msgs/Float64, transient local: share of the plan that was played
START, ABORT = "start", "abort"  # std_srvs/Trigger: begin the plan, stop it
UNDER_WAY = "under way"  # the outcome of a plan that is played now
PLAYED = "played to its end"  # the outcome of a plan that nothing has stopped
CLOCK = "/clock"  # rosgraph_msgs/Clock: simulated time, from a twin in lockstep
DIAGNOSTICS = "/diagnostics"  # diagnostic_msgs/DiagnosticArray, once a second

CART, POLE = "cart", "pole"
JOINTS = (CART, POLE)
