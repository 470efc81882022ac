"""Run an episode with Gymnasium alone: a plain loop, and a controller of a few lines.

python examples/gym_loop.py                        # prints the reward of a random policy
python examples/gym_loop.py --render human         # in a window (pygame)
python examples/gym_loop.py --video out/videos     # as MP4, by Gymnasium's RecordVideo
"""

import argparse

import gymnasium as gym

# The module before the colon is imported first, and registers the ids.
ID = "pendulum_rl_env:pendulum_rl_env/InvertedPendulum-v0"


def main() -> None:
    """Run the episodes that the command line asks for."""
    parser = argparse.ArgumentParser(description="Run episodes of a random policy.")
    parser.add_argument("--twin", help="twin file (without one: the INTECO rig)")
    parser.add_argument("--episodes", type=int, default=1, help="how many (1)")
    parser.add_argument("--seed", type=int, default=0, help="of the actions (0)")
    parser.add_argument("--render", choices=["human", "rgb_array"], help="render mode")
    parser.add_argument("--video", metavar="FOLDER", help="record every episode as MP4")
    options = parser.parse_args()

    render_mode = "rgb_array" if options.video else options.render
    env = gym.make(ID, twin=options.twin, render_mode=render_mode)
    if options.video:
        env = gym.wrappers.RecordVideo(env, options.video, lambda episode: True)
    env.action_space.seed(options.seed)
    for episode in range(options.episodes):
        observation, info = env.reset(seed=options.seed + episode)
        total, steps, over = 0.0, 0, False
        while not over:
            action = env.action_space.sample()  # a policy of yours: observation in, action out
            observation, reward, terminated, truncated, info = env.step(action)  # noqa: RUF059
            total, steps, over = total + float(reward), steps + 1, terminated or truncated
        print(f"episode {episode}: reward {total:.1f}, {steps} steps, end: {info['end']}")
    env.close()


if __name__ == "__main__":
    main()
