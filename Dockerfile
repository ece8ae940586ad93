# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
#
#   docker build -t gait_segmentation .
#   docker run --rm --net host --ipc host gait_segmentation \
#       ros2 launch gait_segmentation gait_segmentation.launch.py image:=/camera/image_raw
FROM ros:jazzy-ros-base

SHELL ["/bin/bash", "-o", "pipefail", "-c"]
WORKDIR /robot
COPY . src/gait_segmentation

# Versions are those of Ubuntu 24.04; of pip only what is missing or too old there.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3-pip \
    && rosdep update --rosdistro "$ROS_DISTRO" \
    && rosdep install --from-paths src --ignore-src -y --rosdistro "$ROS_DISTRO" \
    && pip install --no-cache-dir --break-system-packages 'numba>=0.59.1' 'PyMaxflow>=1.3' onnxruntime \
    && rm -rf /var/lib/apt/lists/*

# Compiled for this processor: the kernels are compiled anew at the first start on another.
RUN source "/opt/ros/$ROS_DISTRO/setup.bash" \
    && colcon build --packages-select gait_segmentation \
    && source install/setup.bash \
    && ros2 run gait_segmentation gait_warm_up \
    && sed -i 's|^exec|source /robot/install/setup.bash\nexec|' /ros_entrypoint.sh

CMD ["ros2", "launch", "gait_segmentation", "gait_segmentation.launch.py"]
