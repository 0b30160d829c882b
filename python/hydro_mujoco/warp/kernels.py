"""What the water does to each body, and its way into passive forces, inertia matrix and sensors: Warp kernels."""

import warp as wp

from .arrays import Arrays
from .laws import (
    Drag,
    add_cross_flow,
    add_lift_damping,
    added_mass_load,
    lift_load,
    lower,
    moved,
    munk_load,
    resisting,
    slope_of_squares,
    squares,
    upper,
)
from .sea import flow_at, surface_about
from .wakes import Wakes, remembered
from .wet import wet_part

wp.set_module_options({"enable_backward": False})

#: Greatest speed [m/s] and rate [rad/s]: far beyond any vehicle (crates/effects/src/flow.rs).
FASTEST = wp.constant(1.0e4)
#: Gravity [m/s^2] below which a scene counts as weightless, and the standard one, which then counts.
WEIGHTLESS = wp.constant(1.0e-6)
STANDARD_GRAVITY = wp.constant(9.81)


@wp.func
def drag_of(a: Arrays, world: int, row: int, motion: wp.spatial_vector) -> Drag:
    """Load and damping of drags and lift, and load of Munk's moment, about the origin; whole hull under water."""
    cross_flow = a.cross_flow[world % a.cross_flow.shape[0], row]
    lift = a.lift[world % a.lift.shape[0], row]
    at_middle = moved(a.middle[row])
    flow = at_middle * motion
    drag = Drag()
    drag.load = lift_load(lift, flow) + munk_load(a.munk[world % a.munk.shape[0], row], flow)
    drag.damping = add_lift_damping(lift, flow, drag.damping)
    axis = (a.long_axis[row] + 1) % 3
    other = (a.long_axis[row] + 2) % 3
    length = a.length[row]
    drag = add_cross_flow(drag, cross_flow[0], axis, other, 1.0, wp.vec2(flow[axis], flow[3 + other]), length)
    drag = add_cross_flow(drag, cross_flow[1], other, axis, -1.0, wp.vec2(flow[other], flow[3 + axis]), length)
    drag.load = wp.transpose(at_middle) * drag.load
    drag.damping = wp.transpose(at_middle) * drag.damping * at_middle

    linear = a.linear_drag[world % a.linear_drag.shape[0], row]
    drag.load -= linear * motion
    drag.damping += linear

    quadratic = a.quadratic_drag[world % a.quadratic_drag.shape[0], row]
    at_point = moved(a.quadratic_point[row])
    flow = at_point * motion
    drag.load -= wp.transpose(at_point) * (quadratic * squares(flow))
    drag.damping += wp.transpose(at_point) * slope_of_squares(quadratic, flow) * at_point
    return drag


@wp.func
def buoyancy_of(a: Arrays, world: int, row: int, com: wp.vec3, up: wp.vec3, gravity: float) -> wp.spatial_vector:
    """Load of net buoyancy and of its offset about the origin; com: centre of mass; all in the body's frame."""
    force = a.up_force[world % a.up_force.shape[0], row] * up
    moment = a.up_moment[world % a.up_moment.shape[0], row] + gravity * a.offset[world % a.offset.shape[0], row]
    return wp.spatial_vector(force, wp.cross(moment, up) + wp.cross(com, force))


@wp.func
def constant_of(a: Arrays, world: int, row: int, com: wp.vec3, to_body: wp.mat33) -> wp.spatial_vector:
    """Load of a constant force at the centre of mass, and a torque, about the origin."""
    force = to_body * a.world_force[world % a.world_force.shape[0], row]
    torque = to_body * a.world_torque[world % a.world_torque.shape[0], row]
    return wp.spatial_vector(force, torque + wp.cross(com, force))


@wp.func
def is_finite(load: wp.spatial_vector) -> bool:
    """True where all six numbers are."""
    for i in range(6):
        if not wp.isfinite(load[i]):
            return False
    return True


@wp.func
def within(motion: wp.spatial_vector) -> wp.spatial_vector:
    """The motion, no number beyond the fastest."""
    for i in range(6):
        motion[i] = wp.clamp(motion[i], -FASTEST, FASTEST)
    return motion


@wp.kernel
def loads(
    # Model
    option_timestep: wp.array[float],
    option_gravity: wp.array[wp.vec3],
    body_rootid: wp.array[int],
    dof_parentid: wp.array[int],
    # Data
    time: wp.array[float],
    qvel: wp.array2d[float],
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    subtree_com: wp.array2d[wp.vec3],
    cvel: wp.array2d[wp.spatial_vector],
    cdof_dot: wp.array2d[wp.spatial_vector],
    # The water, and what the options say.
    a: Arrays,
    gust: wp.array2d[wp.vec3],
    learned: wp.array2d[wp.spatial_vector],
    wakes: Wakes,
    has_gravity: bool,
    is_implicit: bool,
    # Out
    wrench: wp.array2d[wp.spatial_vector],
    force: wp.array2d[wp.spatial_vector],
    inertia: wp.array2d[wp.spatial_matrix],
):
    """The wrench on each row's body without the part in proportion to acceleration, and A + h D beside it.

    learned: of checkpoints, like wrench. wrench: force and torque about the origin, body frame. force, inertia: about
    the centre of mass of the tree, rotation before translation, world: MuJoCo's spatial vectors.
    """
    world, row = wp.tid()
    body = a.body[row]
    water = a.water[row]
    origin = xpos[world, body]
    to_world = xmat[world, body]
    to_body = wp.transpose(to_world)
    tree = subtree_com[world, body_rootid[body]]
    arm = origin - tree

    gravity = wp.vec3(0.0, 0.0, 0.0)
    if has_gravity:
        gravity = option_gravity[world % option_gravity.shape[0]]
    magnitude = wp.length(gravity)
    up = wp.vec3(0.0, 0.0, 1.0)
    if magnitude < WEIGHTLESS:
        magnitude = STANDARD_GRAVITY
    else:
        up = -gravity / magnitude

    surface = surface_about(a, water, origin + to_world * a.hull_centre[row], time[world])
    wet = wet_part(a, row, to_body * surface.up, wp.dot(surface.up, surface.point - origin))
    share = wet[0]
    centre = wp.vec3(wet[1], wet[2], wet[3])
    flow = flow_at(a, world, water, origin + to_world * centre, time[world], gust[world, water])
    swell = to_body * flow.acceleration

    spatial = cvel[world, body]
    angular = upper(spatial)
    linear = lower(spatial) + wp.cross(angular, arm)
    motion = within(wp.spatial_vector(to_body * (linear - flow.velocity), to_body * angular))

    com = a.com[row]
    if a.is_root[row]:
        com = to_body * (subtree_com[world, body] - origin)

    mass = a.added_mass[world % a.added_mass.shape[0], row]
    step = option_timestep[world % option_timestep.shape[0]]
    drag = remembered(a, wakes, world, row, motion, step, drag_of(a, world, row, motion))
    wakes.motion[world, row] = motion
    load = drag.load + added_mass_load(mass, motion, swell)
    load += buoyancy_of(a, world, row, com, to_body * up, magnitude)
    load = share * load + constant_of(a, world, row, com, to_body)
    # Weight of the displaced water, and the pressure that accelerates it (Froude-Krylov), at the wet part's centre.
    displaced = a.displaced[world % a.displaced.shape[0], row]
    pressure = share * ((displaced + a.carried[row]) * swell - displaced * (to_body * gravity))
    load += wp.spatial_vector(pressure, wp.cross(centre, pressure)) + learned[world, row]

    implicit = share * mass
    # Acceleration of the origin, as the world sees it, where no degree of freedom accelerates.
    bias = wp.spatial_vector()
    dof = a.dof[row]
    while dof >= 0:
        bias += cdof_dot[world, dof] * qvel[world, dof]
        dof = dof_parentid[dof]
    falling = lower(bias) + wp.cross(upper(bias), arm) + wp.cross(angular, linear)
    load -= implicit * wp.spatial_vector(to_body * falling, to_body * upper(bias))
    if is_implicit:
        implicit += (step * share) * resisting(drag.damping, a.may_push[row])

    if not is_finite(load):
        load = wp.spatial_vector()
        implicit = wp.spatial_matrix()
    wrench[world, row] = load

    # From (rotation, translation) about the tree's centre of mass to (linear, angular) of the origin.
    turn = -to_body * wp.skew(arm)
    spatial_to_body = wp.spatial_matrix()
    for i in range(3):
        for j in range(3):
            spatial_to_body[i, j] = turn[i, j]
            spatial_to_body[i, 3 + j] = to_body[i, j]
            spatial_to_body[3 + i, j] = to_body[i, j]
    back = wp.transpose(spatial_to_body)
    force[world, row] = back * load
    inertia[world, row] = back * implicit * spatial_to_body


@wp.kernel
def into_joints(
    # Model
    dof_parentid: wp.array[int],
    M_rowadr: wp.array[int],
    M_rownnz: wp.array[int],
    # Data
    cdof: wp.array2d[wp.spatial_vector],
    # The water
    a: Arrays,
    rows_start: wp.array[int],
    rows_of_dof: wp.array[int],
    force: wp.array2d[wp.spatial_vector],
    inertia: wp.array2d[wp.spatial_matrix],
    # Out
    qfrc_passive: wp.array2d[float],
    M: wp.array2d[float],
):
    """Adds the forces on all bodies that a degree of freedom moves, and their inertia to its row of M."""
    world, dof = wp.tid()
    axis = cdof[world, dof]
    diagonal = M_rowadr[dof] + M_rownnz[dof] - 1
    passive = float(0.0)
    for at in range(rows_start[dof], rows_start[dof + 1]):
        row = rows_of_dof[at]
        passive += wp.dot(axis, force[world, row])
        moved_axis = inertia[world, row] * axis
        if a.has_room[row]:
            other = dof
            place = diagonal
            while other >= 0:
                M[world, place] += wp.dot(cdof[world, other], moved_axis)
                other = dof_parentid[other]
                place -= 1
        else:
            # No room for products: the sum of the row bounds them, so that the step stays stable.
            lumped = float(0.0)
            other = a.dof[row]
            while other >= 0:
                lumped += wp.abs(wp.dot(cdof[world, other], moved_axis))
                other = dof_parentid[other]
            M[world, diagonal] += lumped
    qfrc_passive[world, dof] += passive


@wp.kernel
def into_sensors(
    sensor_adr: wp.array[int],
    sensor_body: wp.array[int],
    a: Arrays,
    wrench: wp.array2d[wp.spatial_vector],
    sensordata: wp.array2d[float],
):
    """Writes the wrench on a body to each sensor of its instance."""
    world, sensor = wp.tid()
    sum = wp.spatial_vector()
    for row in range(a.body.shape[0]):
        if a.body[row] == sensor_body[sensor]:
            sum += wrench[world, row]
    for i in range(6):
        sensordata[world, sensor_adr[sensor] + i] = sum[i]
