# SPDX-License-Identifier: Apache-2.0
# Copies the message types that the peer on Fast DDS speaks out of interfaces/dds/idl/ros_messages.idl. Each stands there in
# modules of its own. fastddsgen warns of the annotation @topic, which says nothing to it.
/^module / { text = ""; wanted = 0 }
{ sub(/@topic /, ""); text = text $0 "\n" }
/struct (Time|Header|String|Vector3|Quaternion|Transform|TransformStamped|TFMessage|Image|RegionOfInterest|CameraInfo)_ / { wanted = 1 }
/^}; }; };/ { if (wanted) printf "%s", text; wanted = 0; text = "" }
