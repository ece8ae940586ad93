# SPDX-FileCopyrightText: The gait_segmentation contributors
# SPDX-License-Identifier: GPL-3.0-or-later
"""ROS helpers the nodes share: conversion, parameters, QoS, joins, lifecycle."""
