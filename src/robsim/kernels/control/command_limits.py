"""Limits of the command. They guarantee that the joints can always stop in time.

A velocity is constant until the next command, which comes after at most the time `hold`: the period
dt, or a longer time if calls may be late. A command changes a velocity by at most a dt. A motion is
safe if from the next command on it can be braked to rest within its limits, even if each command
acts for the time `hold`. If the last command was safe, braking is safe, so a safe command always
exists.
"""

import math

from robsim.kernels.formulas.perspective import IN_IMAGE
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import WIDTH, get, put
from robsim.kernels.machine.stages import stage

# bits of the row `reason`: why the command differs from the command of the law
OLD_IMAGE, NOT_RELEASED, STOPPED, NOT_FINITE, FEW_MARKS = 1, 2, 4, 8, 16
SPEED, ACCELERATION, JOINT_LIMIT, FENCE, LATE_CALL = 32, 64, 128, 256, 512
HELD = OLD_IMAGE | NOT_RELEASED | STOPPED | NOT_FINITE | FEW_MARKS | LATE_CALL

FENCE_TOLERANCE = 1e-12  # metres
AGE_TOLERANCE = 1e-3  # periods: tolerance of an image's age, as clocks are not exact
SPEED_TOLERANCE = 1.0 + 1e-9  # factor on the largest safe velocity in comparisons


@kernel
def braking_speed(distance, deceleration, dt):
    """Return the largest velocity v >= 0 that allows a stop within a distance after a period dt.

    From the next period on the velocity falls by a dt in each period, with the deceleration a.
    After m periods the path is dt (v + (v - a dt) + ... + (v - m a dt))
    = dt ((m + 1) v - a dt m (m + 1) / 2), and m is the largest number with
    a dt^2 m (m + 1) / 2 <= distance.
    """
    if not distance > 0.0:
        return 0.0
    if math.isinf(distance):
        return distance
    change = deceleration * dt
    if math.isinf(change):
        return distance / dt
    m = math.floor(0.5 * (math.sqrt(1.0 + 8.0 * distance / (change * dt)) - 1.0))
    return distance / ((m + 1.0) * dt) + 0.5 * change * m


@kernel
def smoothstep(share):
    """Return the smooth step 3 x^2 - 2 x^3 from 0 to 1."""
    x = min(share, 1.0)
    return x * x * (3.0 - 2.0 * x)


@entry("float64, float64 -> float64")
def remaining_share(rest, dt):
    """Return the share of a velocity after one period of braking that takes `rest` seconds."""
    return 1.0 - dt / rest if rest > dt else 0.0


@part
def _braking_time(w, b, n, qd, accelerations):
    """Return the shortest time in seconds to brake velocities along their direction.

    The rows `accelerations` are the largest accelerations of the joints.
    """
    longest = 0.0
    for j in range(n):
        longest = max(longest, abs(w[(qd + j) * WIDTH + b]) / w[(accelerations + j) * WIDTH + b])
    return longest


@part
def _clamp(x, least, most):
    """Return x clipped to [least, most]."""
    return min(max(x, least), most)


@part
def _hold_reasons(w, b, n, law_command, age, dt, released, settings, latched, status):
    """Return the reasons to hold the robot as bits, 0 for none."""
    reasons = FEW_MARKS if w[status * WIDTH + b] != IN_IMAGE else 0
    if (w[age * WIDTH + b] - AGE_TOLERANCE) * w[dt * WIDTH + b] > w[settings * WIDTH + b]:
        reasons |= OLD_IMAGE
        if w[(settings + 1) * WIDTH + b] != 0.0:
            w[latched * WIDTH + b] = 1.0
    if w[released * WIDTH + b] == 0.0:
        reasons |= NOT_RELEASED
    elif w[released * WIDTH + b] < 0.0:
        reasons |= LATE_CALL
    if w[latched * WIDTH + b] != 0.0:
        reasons |= STOPPED
    for j in range(n):
        if not math.isfinite(w[(law_command + j) * WIDTH + b]):
            reasons |= NOT_FINITE
    return reasons


@stage
def hold_command(
    w,
    step,
    n="count",
    law_command="n",
    dt="row",
    age="row",
    released="row",
    settings="3",
    latched="row",
    time_since_hold="row",
    share="row",
    reason="row",
    status="row",
):
    """Compute the share of the law's command that is executed, and the reasons to hold the robot.

    The robot is held unless `released` is positive; a negative value is a late call. `age` is the
    age of the image in periods. The settings are the largest age of an image in seconds, 1 if an
    older image stops the robot permanently, else 0, and the time in seconds in which the share
    rises from 0 to 1. `latched` is 1 in a robot that was stopped permanently. `time_since_hold` is
    the time in seconds since the robot was last held. The status is IN_IMAGE if enough marks remain
    in the image.
    """
    seconds = time_since_hold * WIDTH
    for b in range(WIDTH):
        reasons = _hold_reasons(w, b, n, law_command, age, dt, released, settings, latched, status)
        ramp = w[(settings + 2) * WIDTH + b]
        if reasons:
            w[seconds + b] = 0.0
            w[share * WIDTH + b] = 0.0
        else:
            w[share * WIDTH + b] = smoothstep(w[seconds + b] / ramp) if ramp > 0.0 else 1.0
            w[seconds + b] += w[dt * WIDTH + b]
        w[reason * WIDTH + b] = reasons


@part
def _reachable_velocity(target, last_velocity, largest_change):
    """Return the reachable velocity nearest to a target, and the reason bits if both differ."""
    v = _clamp(target, last_velocity - largest_change, last_velocity + largest_change)
    return v, 0 if v == target else ACCELERATION


@part
def _bound(v, least, largest, last_velocity, largest_change):
    """Return v clipped to [least, largest], as far as the acceleration allows.

    The acceleration is too small only if a command acted longer than planned, or if the measured
    coordinate is not the predicted one.
    """
    safe = _clamp(v, least, largest)
    if abs(safe - last_velocity) > largest_change * SPEED_TOLERANCE:
        safe = _clamp(safe, last_velocity - largest_change, last_velocity + largest_change)
    return safe


@part
def _braking_bounds(w, b, x, low, high, deceleration, hold):
    """Return the least and the largest velocity that keep a coordinate within its limits."""
    least = -braking_speed(x - w[low * WIDTH + b], deceleration, hold)
    return least, braking_speed(w[high * WIDTH + b] - x, deceleration, hold)


@stage
def limit_command(
    w,
    step,
    n="count",
    law_command="n",
    scaled="n",
    last="n",
    target="n",
    lowest="n",
    highest="n",
    slowest="n",
    fastest="n",
    brake="n",
    shares="row",
    reason="row",
    duration="row",
    hold="row",
    accelerations="n",
    speeds="n",
    low="n",
    high="n",
    q="nq",
    at_limit="n",
    places="each: whole",
    nq="count",
):
    """Compute the target of a command, its bounds, and the braking velocities `brake`.

    `scaled` is the command of the law after scaling to the speed limits, and `last` is the last
    command. `low` and `high` are the limits of the coordinates of n joints. `places` holds the
    index in q of each coordinate, or -1 for a joint without limits. Velocities between `lowest` and
    `highest` respect the speed and the limits of a joint, and velocities between `slowest` and
    `fastest` its acceleration, too. A held robot brakes: its target is within all bounds.
    """
    for b in range(WIDTH):
        dt, share, hold_reasons = (
            w[duration * WIDTH + b],
            w[shares * WIDTH + b],
            int(w[reason * WIDTH + b]),
        )
        rest, reasons = _braking_time(w, b, n, last, accelerations), hold_reasons
        brake_share = remaining_share(rest, dt)
        for j in range(n):
            last_velocity, most = w[(last + j) * WIDTH + b], w[(accelerations + j) * WIDTH + b]
            brake_velocity, wanted = brake_share * last_velocity, w[(scaled + j) * WIDTH + b]
            if not hold_reasons and wanted != w[(law_command + j) * WIDTH + b]:
                reasons |= SPEED
            wanted, change = share * wanted, most * dt
            v, bits = _reachable_velocity(
                brake_velocity if hold_reasons else wanted, last_velocity, change
            )
            least, largest = -math.inf, math.inf
            if places[1 + j] >= 0:
                x = w[(q + places[1 + j]) * WIDTH + b]
                deceleration = most * (dt / w[hold * WIDTH + b])
                least, largest = _braking_bounds(
                    w, b, x, low + j, high + j, deceleration, w[hold * WIDTH + b]
                )
            is_at_limit = v < least * SPEED_TOLERANCE or v > largest * SPEED_TOLERANCE
            reasons |= bits | (JOINT_LIMIT if is_at_limit else 0)
            w[(at_limit + j) * WIDTH + b] = 1.0 if is_at_limit else 0.0
            w[(brake + j) * WIDTH + b] = _bound(
                brake_velocity, least, largest, last_velocity, change
            )
            if hold_reasons:
                v = _bound(v, least, largest, last_velocity, change)
                own = v, v, v, v, v
            else:
                speed = max(w[(speeds + j) * WIDTH + b], abs(wanted))  # after rounding
                least, largest = max(least, -speed), min(largest, speed)
                slow = _bound(last_velocity - change, least, largest, last_velocity, change)
                fast = _bound(last_velocity + change, least, largest, last_velocity, change)
                own = wanted, least, largest, slow, fast
            w[(target + j) * WIDTH + b] = own[0]
            w[(lowest + j) * WIDTH + b], w[(highest + j) * WIDTH + b] = own[1], own[2]
            w[(slowest + j) * WIDTH + b], w[(fastest + j) * WIDTH + b] = own[3], own[4]
        w[reason * WIDTH + b] = reasons


@part
def _periods_until_rest(v_over_fall):
    """Return the braking path in units of the first velocity times the period of a command.

    The velocity is held for one period and then falls linearly to rest in the time T. With
    m = floor(T / dt) the sum of 1 - k dt / T is m + 1 - (dt / T) m (m + 1) / 2.
    """
    m = math.floor(v_over_fall)
    return m + 1.0 if m == 0.0 else m + 1.0 - 0.5 * m * (m + 1.0) / v_over_fall


@stage
def compute_attempts(
    w,
    step,
    n="count",
    command="n",
    brake="n",
    duration="row",
    hold="row",
    accelerations="n",
    tries="count",
    velocities="tries, n",
    seconds="tries",
):
    """Compute attempts of a command, and for each attempt the duration of its braking path.

    The attempts velocities[tries, n] are brake + share (command - brake) for share = 1, 1/2, 1/4,
    ... An attempt covers its braking path at constant velocity in `seconds`.
    """
    for b in range(WIDTH):
        dt, share = w[duration * WIDTH + b], 1.0
        for k in range(tries):
            qd = velocities + k * n
            for j in range(n):
                brake_velocity = w[(brake + j) * WIDTH + b]
                w[(qd + j) * WIDTH + b] = brake_velocity + share * (
                    w[(command + j) * WIDTH + b] - brake_velocity
                )
            rest = _braking_time(w, b, n, qd, accelerations)
            w[(seconds + k) * WIDTH + b] = w[hold * WIDTH + b] * _periods_until_rest(rest / dt)
            share *= 0.5


@part
def _stopping_bounds(w, b, x, low, high, seconds):
    """Return the least and the largest velocity that stop a coordinate within its limits.

    The coordinate covers its braking path at constant velocity in `seconds`. Outside its limits it
    may move inwards only.
    """
    least = min((w[low * WIDTH + b] - x) / seconds, 0.0)
    return least, max((w[high * WIDTH + b] - x) / seconds, 0.0)


@stage
def limit_attempts(
    w,
    step,
    n="count",
    tries="count",
    velocities="tries, n",
    seconds="tries",
    last="n",
    duration="row",
    hold="row",
    accelerations="n",
    low="n",
    high="n",
    q="nq",
    reason="row",
    at_limit="n",
    places="each: whole",
    nq="count",
):
    """Slow joints in the attempts of a command, so that all joints stop together within limits.

    In `limit_command` each joint brakes alone. A frame near its box brakes along one direction, so
    that the slowest joint determines the time of all joints. An attempt gets infinite `seconds` if
    the acceleration of a joint is too small for its limit.
    """
    for b in range(WIDTH):
        dt = w[duration * WIDTH + b]
        for k in range(tries):
            qd, path, fits = velocities + k * n, (seconds + k) * WIDTH + b, True
            for j in range(n):
                if places[1 + j] >= 0:
                    v, x = w[(qd + j) * WIDTH + b], w[(q + places[1 + j]) * WIDTH + b]
                    least, largest = _stopping_bounds(w, b, x, low + j, high + j, w[path])
                    change = w[(accelerations + j) * WIDTH + b] * dt
                    slow, _ = _reachable_velocity(
                        _clamp(v, least, largest), w[(last + j) * WIDTH + b], change
                    )
                    w[(qd + j) * WIDTH + b] = slow
                    fits &= least * SPEED_TOLERANCE <= slow <= largest * SPEED_TOLERANCE
                    if k == 0 and not least * SPEED_TOLERANCE <= v <= largest * SPEED_TOLERANCE:
                        w[(at_limit + j) * WIDTH + b] = 1.0
                        w[reason * WIDTH + b] = int(w[reason * WIDTH + b]) | JOINT_LIMIT
            rest = _braking_time(w, b, n, qd, accelerations)
            w[path] = w[hold * WIDTH + b] * _periods_until_rest(rest / dt) if fits else math.inf


@part
def _distance_outside(w, b, x, box, c):
    """Return the distance of a coordinate x from a box along the axis c; 0 inside."""
    return max(w[(box + c) * WIDTH + b] - x, x - w[(box + 3 + c) * WIDTH + b], 0.0)


@part
def _is_within_fence(w, b, box, current_pose, poses, first, places, bernstein):
    """Return whether a frame's path is nowhere farther outside along any axis than now.

    The path is the polynomial through the poses. It is inside the convex hull of its Bernstein
    coefficients (Farin, Curves and Surfaces for CAGD, 5th ed., section 4.3).
    """
    for c in range(3):
        position = 4 * c + 3
        now = w[(current_pose + position) * WIDTH + b]
        far = _distance_outside(w, b, now, box, c) + FENCE_TOLERANCE
        for k in range(places):
            x = now
            for i in range(places):
                factor = w[(bernstein + k * places + i) * WIDTH + b]
                x += factor * (w[(poses[first + i] + position) * WIDTH + b] - now)
            if not _distance_outside(w, b, x, box, c) <= far:
                return False
    return True


@stage
def fence_command(
    w,
    step,
    n="count",
    attempts="tries, n",
    brake="n",
    out="n",
    reason="row",
    box="2, 3",
    current_pose="3, 4",
    tries="count",
    places="count",
    bernstein="places, places",
    poses="each: 3, 4",
):
    """Command the first attempt that lets a frame brake within a box, or brake.

    `current_pose` is the pose of the frame now. `poses` are its poses on the braking paths, with
    `places` poses for each attempt, at equal distances. The matrix `bernstein` converts their
    distances from the current pose to Bernstein coefficients, without the first coefficient. A
    frame outside the box may move inwards.
    """
    for b in range(WIDTH):
        first = brake
        for k in range(tries - 1, -1, -1):
            if _is_within_fence(w, b, box, current_pose, poses, 1 + places * k, places, bernstein):
                first = attempts + k * n
        if first != attempts:
            w[reason * WIDTH + b] = int(w[reason * WIDTH + b]) | FENCE
        for j in range(n):
            w[(out + j) * WIDTH + b] = w[(first + j) * WIDTH + b]


@stage
def store_command(w, step, n="count", out="n", last="n", reason="row", busy="row", share="row"):
    """Store the command as `last`, and set `busy` to 1 while the run must not end.

    The run must not end while the robot is held temporarily or accelerates.
    """
    for b in range(WIDTH):
        for j in range(n):
            w[(last + j) * WIDTH + b] = w[(out + j) * WIDTH + b]
        why = int(w[reason * WIDTH + b])
        temporary = OLD_IMAGE | NOT_RELEASED | LATE_CALL | ACCELERATION
        waits = why & STOPPED == 0 and why & temporary != 0
        grows = why & STOPPED == 0 and w[share * WIDTH + b] < 1.0
        w[busy * WIDTH + b] = 1.0 if waits or grows else 0.0


@stage
def bound_velocities(
    w,
    step,
    n="count",
    q="nq",
    nq="count",
    places="each: whole",
    last="n",
    dt="row",
    hold="row",
    speeds="n",
    accelerations="n",
    least="n",
    most="n",
    low="n",
    high="n",
):
    """Compute bounds [low, high] of n velocities from limits of joints.

    `least` and `most` are the limits of the coordinates, `places` their indices in q (-1: without
    limits), and `last` is the last command. A bound that cannot be reached within the acceleration
    gives way to the acceleration, so that low <= high.
    """
    for b in range(WIDTH):
        duration, held = w[dt * WIDTH + b], w[hold * WIDTH + b]
        for j in range(n):
            acceleration, speed = w[(accelerations + j) * WIDTH + b], w[(speeds + j) * WIDTH + b]
            slow, fast = -speed, speed
            if places[1 + j] >= 0:
                x = w[(q + places[1 + j]) * WIDTH + b]
                deceleration = acceleration * (duration / held)
                brake = _braking_bounds(w, b, x, least + j, most + j, deceleration, held)
                slow, fast = max(slow, brake[0]), min(fast, brake[1])
            before, change = w[(last + j) * WIDTH + b], acceleration * duration
            if change < math.inf:
                slow = _clamp(slow, before - change, before + change)
                fast = _clamp(fast, before - change, before + change)
            w[(low + j) * WIDTH + b], w[(high + j) * WIDTH + b] = slow, fast


@stage
def remember_command(w, step, n="count", qd="n", past="p, n", p="count"):
    """Store the command qd as the newest of p past commands."""
    for i in range(p - 1, 0, -1):
        for j in range(n):
            put(w, past + n * i + j, get(w, past + n * (i - 1) + j))
    for j in range(n):
        put(w, past + j, get(w, qd + j))
