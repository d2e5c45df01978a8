"""The tracking environment in a learner of your own: PPO in PyTorch, on precision pinches.

    pip install torch 'mjx-hand[gym]'
    python examples/05_environment_in_your_own_learner.py [--updates 100] [--num-envs 128]

`TrackingVectorEnv` is a Gymnasium vector environment, NumPy in and out, so that any learner can take it. This one is
short and not tuned; `mjx-hand train` is the project's own.
"""

# PyTorch is no dependency of the project.
# pyright: reportMissingImports=false
import numpy as np
import torch
import tyro
from torch import Tensor, nn
from torch.distributions import Normal

from envs.gym import TrackingVectorEnv, make_vector_env

GAMMA, LAMBDA, CLIP, EPOCHS, MINIBATCHES, UNROLL = 0.97, 0.95, 0.2, 4, 8, 16
REWARD_SCALE = 0.1  # brings returns to about 1 to 6, which networks learn quickest


class Policy(nn.Module):
    """Mean and spread of the actions, and the value of an observation."""

    def __init__(self, observation_size: int, action_size: int):
        super().__init__()
        last = nn.Linear(128, action_size)
        nn.init.normal_(last.weight, std=0.001)  # begins with the reference as it is
        self.mean = nn.Sequential(mlp(observation_size, 128), last)
        self.value = nn.Sequential(mlp(observation_size, 256), nn.Linear(256, 1), nn.Flatten(-2))
        self.log_std = nn.Parameter(torch.full((action_size,), np.log(0.4)))

    def distribution(self, observations: Tensor) -> Normal:
        return Normal(self.mean(observations), self.log_std.exp())


def mlp(inputs: int, hidden: int) -> nn.Sequential:
    """Two hidden layers."""
    return nn.Sequential(nn.Linear(inputs, hidden), nn.SiLU(), nn.Linear(hidden, hidden), nn.SiLU())


def unroll(env: TrackingVectorEnv, policy: Policy, observations: np.ndarray) -> tuple[list[Tensor], np.ndarray, float]:
    """UNROLL steps of all worlds: what PPO learns from, the observations to go on from, and the mean reward a step."""
    rows, rewards_of_all = [], []
    for _ in range(UNROLL):
        seen = torch.from_numpy(observations)
        distribution = policy.distribution(seen)
        action = distribution.sample()
        observations, rewards, terminated, truncated, infos = env.step(action.numpy())
        rewards_of_all.append(rewards.mean())
        reward = torch.from_numpy(rewards * REWARD_SCALE)
        if truncated.any():  # the demonstration ended, the world did not: what would have come after counts
            last = torch.from_numpy(np.stack(infos["final_obs"][truncated]))
            reward[torch.from_numpy(truncated)] += GAMMA * policy.value(last)
        going = torch.from_numpy(~(terminated | truncated)).float()
        rows.append((seen, action, distribution.log_prob(action).sum(-1), policy.value(seen), reward, going))
    seen, action, log_prob, value, reward, going = (torch.stack(column) for column in zip(*rows, strict=True))
    following = torch.cat([value[1:], policy.value(torch.from_numpy(observations))[None]])
    advantage, later = torch.zeros_like(value), torch.zeros_like(value[0])
    for t in reversed(range(UNROLL)):  # generalised advantage estimation
        later = reward[t] + GAMMA * following[t] * going[t] - value[t] + GAMMA * LAMBDA * going[t] * later
        advantage[t] = later
    flat = [column.flatten(0, 1) for column in (seen, action, log_prob, advantage, advantage + value)]
    return flat, observations, float(np.mean(rewards_of_all))


def update(policy: Policy, optimiser: torch.optim.Optimizer, data: list[Tensor]) -> None:
    """Some passes of clipped policy gradient over what was unrolled."""
    for _ in range(EPOCHS):
        for rows in torch.randperm(len(data[0])).chunk(MINIBATCHES):
            seen, action, log_prob, advantage, target = (column[rows] for column in data)
            advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
            ratio = (policy.distribution(seen).log_prob(action).sum(-1) - log_prob).exp()
            gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage).mean()
            loss = 0.5 * (policy.value(seen) - target).square().mean() - gain
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
            optimiser.step()


@torch.no_grad()
def evaluate(env: TrackingVectorEnv, policy: Policy) -> tuple[float, float]:
    """Of rollouts without noise from frame 0: the share that never lost the object, and the mean return."""
    which = np.arange(env.num_envs) % env.env.num_demonstrations
    observations, _ = env.reset(options={"demonstration": which})
    alive, followed, total = np.ones(env.num_envs, bool), np.zeros(env.num_envs, bool), np.zeros(env.num_envs)
    while alive.any():
        observations, rewards, terminated, truncated, _ = env.step(policy.mean(torch.from_numpy(observations)).numpy())
        total += rewards * alive
        followed |= alive & truncated
        alive &= ~(terminated | truncated)
    return float(followed.mean()), float(total.mean())


def train(env: TrackingVectorEnv, updates: int = 100, seed: int = 0) -> tuple[Policy, list[tuple[float, float]]]:
    """The trained policy; success and return before, midway and after."""
    torch.manual_seed(seed)
    policy = Policy(env.env.observation_size, env.env.action_size)
    optimiser = torch.optim.Adam(policy.parameters(), lr=5e-4)
    scores = [evaluate(env, policy)]
    print(f"untrained: {scores[0][0]:.0%} followed to the end, return {scores[0][1]:.0f}", flush=True)
    observations, _ = env.reset(seed=seed)
    for k in range(1, updates + 1):
        with torch.no_grad():
            data, observations, reward = unroll(env, policy, observations)
        update(policy, optimiser, data)
        if k % 10 == 0:
            print(f"{k * UNROLL * env.num_envs:,} steps: reward {reward:.2f} a step", flush=True)
        if k in (updates // 2, updates):
            scores.append(evaluate(env, policy))
            print(f"  {scores[-1][0]:.0%} followed to the end, return {scores[-1][1]:.0f}", flush=True)
            observations, _ = env.reset()
    return policy, scores


def main(updates: int = 100, num_envs: int = 128, seed: int = 0) -> None:
    """Train on the demonstrations of `mjx-hand train config=pinch`, which are made where they are missing."""
    env = make_vector_env("pinch", num_envs, autoreset_mode="SameStep")
    train(env, updates, seed)
    env.close()


if __name__ == "__main__":
    tyro.cli(main)
