// Written by build_kernel.py from lean_yaw_env.vehicles; do not edit. SI units, angles in radians.

export const PAPER_BICYCLE = {
  "wheelbase": 1.02,
  "trail": 0.08,
  "steer_axis_tilt": 0.3217505543966422,
  "gravity": 9.81,
  "rear_wheel": {
    "radius": 0.3,
    "mass": 2.0,
    "inertia_xx": 0.06,
    "inertia_yy": 0.12
  },
  "rear_frame": {
    "mass": 85.0,
    "x": 0.3,
    "z": -0.9,
    "inertia_xx": 9.2,
    "inertia_xz": 2.4,
    "inertia_yy": 11.0,
    "inertia_zz": 2.8
  },
  "front_frame": {
    "mass": 4.0,
    "x": 0.9,
    "z": -0.7,
    "inertia_xx": 0.0546,
    "inertia_xz": -0.0162,
    "inertia_yy": 0.06,
    "inertia_zz": 0.0114
  },
  "front_wheel": {
    "radius": 0.35,
    "mass": 3.0,
    "inertia_xx": 0.14,
    "inertia_yy": 0.28
  }
};
export const BENCHMARK_BICYCLE = {
  "wheelbase": 1.02,
  "trail": 0.08,
  "steer_axis_tilt": 0.3141592653589793,
  "gravity": 9.81,
  "rear_wheel": {
    "radius": 0.3,
    "mass": 2.0,
    "inertia_xx": 0.0603,
    "inertia_yy": 0.12
  },
  "rear_frame": {
    "mass": 85.0,
    "x": 0.3,
    "z": -0.9,
    "inertia_xx": 9.2,
    "inertia_xz": 2.4,
    "inertia_yy": 11.0,
    "inertia_zz": 2.8
  },
  "front_frame": {
    "mass": 4.0,
    "x": 0.9,
    "z": -0.7,
    "inertia_xx": 0.05892,
    "inertia_xz": -0.00756,
    "inertia_yy": 0.06,
    "inertia_zz": 0.00708
  },
  "front_wheel": {
    "radius": 0.35,
    "mass": 3.0,
    "inertia_xx": 0.1405,
    "inertia_yy": 0.28
  }
};
export const SKATEBOARD = {
  "mass": 70.0,
  "rider_height": 1.0,
  "wheelbase": 0.4,
  "steering_tilt": 0.7853981633974483,
  "spring_stiffness": 150.0,
  "gravity": 9.81,
  "damping": 0.0
};
