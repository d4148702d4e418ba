"""Settings of training runs: what all algorithms have in common, and those of PPO and SAC."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TrainingConfig:
    """Settings of any algorithm.

    Attributes:
        total_steps: Control steps of a run, summed over all robots.
        worlds: Number of robots that are stepped together.
        chunk: Control steps of every robot between two updates.
        layers: Widths of the hidden layers.
        activation: Activation function of the policy's hidden layers: ``tanh``, ``relu`` or
            ``elu``.
        learning_rate: Learning rate of Adam at the start.
        discount: Discount factor per control step.
        average_rate: Rate per update of the moving average of the actor, which is what a run saves: it walks
            more steadily than any single actor.
        evaluate_every: Control steps between two evaluations.
        evaluate_episodes: Episodes of an evaluation.
        evaluate_steps: Control steps of an evaluated episode.
        evaluate_robots: Robots on which these episodes run at a time.
        imitates: Whether the policy first learns from the robot's rule-based driver: PPO to act as it does,
            and SAC from what it does instead of random actions.
        initial_policy: Weights file or name of the shipped policy that the run starts from, instead of the
            recipe's. PPO imitates one with other layers first, and SAC imitates any.
        imitation_rounds: Rounds of imitation at the start, of 500 control steps of every robot each.
        reward_scale: Factor on rewards, which brings the values to the order of 1.
        keeps_checkpoints: Whether the policy is kept at the start and after each 2 % of the steps.
    """

    total_steps: int
    worlds: int
    chunk: int
    layers: tuple[int, ...] = (256, 256)
    activation: str = "tanh"
    learning_rate: float = 3e-4
    discount: float = 0.99
    average_rate: float = 0.002
    evaluate_every: int = 200_000
    evaluate_episodes: int = 32
    evaluate_steps: int = 1000
    evaluate_robots: int = 32
    imitates: bool = False
    initial_policy: str = ""
    imitation_rounds: int = 3
    reward_scale: float = 1.0
    keeps_checkpoints: bool = False


@dataclass(frozen=True)
class PpoConfig(TrainingConfig):
    """Settings of Proximal Policy Optimization.

    Attributes:
        processes: Whether the robots run in processes of their own, which simulators need that hold Python's
            lock while they step.
        epochs: Passes over the collected steps per update.
        minibatch: Samples per gradient step.
        divergence: Mean divergence per gradient step that the learning rate is adapted to.
        final_divergence: Share of `divergence` to which it falls, linearly, in the second half of the run.
        clip: Range of the probability ratio around 1 in the clipped surrogate.
        gae: λ of the generalized advantage estimation.
        entropy: Weight of the entropy bonus.
        log_std: Initial log standard deviation of the actions.
        critic_iterations: Iterations at the start in which only the critic learns, so that an untrained one
            does not spoil a policy that can act already.
        least_deviation: Least deviation by which an observed number is divided. Numbers that hardly change
            in training may change a lot elsewhere.
    """

    total_steps: int = 2_000_000
    worlds: int = 64
    chunk: int = 32
    processes: bool = False
    epochs: int = 4
    minibatch: int = 512
    divergence: float = 0.012
    final_divergence: float = 0.2
    clip: float = 0.2
    gae: float = 0.95
    entropy: float = 0.001
    log_std: float = -0.5
    critic_iterations: int = 0
    reward_scale: float = 0.02
    least_deviation: float = 0.0


@dataclass(frozen=True)
class SacConfig(TrainingConfig):
    """Settings of Soft Actor-Critic.

    Attributes:
        steps_per_update: Control steps per update of the critics.
        batch: Transitions per update.
        final_rate: Share of `learning_rate` that is left at the end of the run.
        tau: Rate per update at which the target critics follow the critics.
        random_steps: Control steps with random actions before learning starts, or with those of a rule-based
            driver or of the policy that the run starts from. In the latter, only the critics learn.
        capacity: Transitions that the replay buffer holds.
    """

    total_steps: int = 1_200_000
    worlds: int = 16
    chunk: int = 8
    average_rate: float = 0.0005
    evaluate_every: int = 100_000
    steps_per_update: int = 4
    batch: int = 128
    final_rate: float = 0.1
    tau: float = 0.005
    random_steps: int = 10_000
    capacity: int = 1_000_000
