// SPDX-License-Identifier: Apache-2.0
// The table behind schemas.h: each message's names, type hash and text, ascending by package.
#include <array>

#include "prescene/interfaces/ros_messages/schemas.h"

namespace prescene::interfaces {
namespace {

constexpr std::array<RosType, 77> kTypes = {{
    {"builtin_interfaces/msg/Duration", "builtin_interfaces::msg::dds_::Duration_",
     "RIHS01_e8d009f659816f758b75334ee1a9ca5b5c0b859843261f14c7f937349599d93b",
     "int32 sec\n"
     "uint32 nanosec\n"},
    {"builtin_interfaces/msg/Time", "builtin_interfaces::msg::dds_::Time_",
     "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197",
     "int32 sec\n"
     "uint32 nanosec\n"},
    {"diagnostic_msgs/msg/DiagnosticArray", "diagnostic_msgs::msg::dds_::DiagnosticArray_",
     "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
     "std_msgs/Header header\n"
     "DiagnosticStatus[] status\n"},
    {"diagnostic_msgs/msg/DiagnosticStatus", "diagnostic_msgs::msg::dds_::DiagnosticStatus_",
     "RIHS01_b0e3e692ea2d54a8af2f4ef1930e81556a2db55216b771f8a7d2724ed47bf0e4",
     "byte level\n"
     "string name\n"
     "string message\n"
     "string hardware_id\n"
     "KeyValue[] values\n"},
    {"diagnostic_msgs/msg/KeyValue", "diagnostic_msgs::msg::dds_::KeyValue_",
     "RIHS01_d68081eaa540288c5440753baecef0c4e16e81a5f78ad68902ded5100413bb42",
     "string key\n"
     "string value\n"},
    {"geometry_msgs/msg/Point", "geometry_msgs::msg::dds_::Point_",
     "RIHS01_6963084842a9b04494d6b2941d11444708d892da2f4b09843b9c43f42a7f6881",
     "float64 x\n"
     "float64 y\n"
     "float64 z\n"},
    {"geometry_msgs/msg/Point32", "geometry_msgs::msg::dds_::Point32_",
     "RIHS01_2fc4db7cae16a4582c79a56b66173a8d48d52c7dc520ddc55a0d4bcf2a4bfdbc",
     "float32 x\n"
     "float32 y\n"
     "float32 z\n"},
    {"geometry_msgs/msg/Polygon", "geometry_msgs::msg::dds_::Polygon_",
     "RIHS01_3782f9f0bf044964d692d6c017d705e37611afb1f0bf6a9dee248a7dda0f784a", "Point32[] points\n"},
    {"geometry_msgs/msg/Pose", "geometry_msgs::msg::dds_::Pose_",
     "RIHS01_d501954e9476cea2996984e812054b68026ae0bfae789d9a10b23daf35cc90fa",
     "Point position\n"
     "Quaternion orientation\n"},
    {"geometry_msgs/msg/PoseArray", "geometry_msgs::msg::dds_::PoseArray_",
     "RIHS01_af0cc36d190e104d546d168d6b39df04fa4b4ccecf59cb4c9ed328d3d5004aa0",
     "std_msgs/Header header\n"
     "Pose[] poses\n"},
    {"geometry_msgs/msg/PoseStamped", "geometry_msgs::msg::dds_::PoseStamped_",
     "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
     "std_msgs/Header header\n"
     "Pose pose\n"},
    {"geometry_msgs/msg/PoseWithCovariance", "geometry_msgs::msg::dds_::PoseWithCovariance_",
     "RIHS01_9a7c0fd234b7f45c6098745ecccd773ca1085670e64107135397aee31c02e1bb",
     "Pose pose\n"
     "float64[36] covariance\n"},
    {"geometry_msgs/msg/PoseWithCovarianceStamped", "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_",
     "RIHS01_26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
     "std_msgs/Header header\n"
     "PoseWithCovariance pose\n"},
    {"geometry_msgs/msg/Quaternion", "geometry_msgs::msg::dds_::Quaternion_",
     "RIHS01_8a765f66778c8ff7c8ab94afcc590a2ed5325a1d9a076ffff38fbce36f458684",
     "float64 x 0\n"
     "float64 y 0\n"
     "float64 z 0\n"
     "float64 w 1\n"},
    {"geometry_msgs/msg/Transform", "geometry_msgs::msg::dds_::Transform_",
     "RIHS01_beb83fbe698636351461f6f35d1abb20010c43d55374d81bd041f1ba2581fddc",
     "Vector3 translation\n"
     "Quaternion rotation\n"},
    {"geometry_msgs/msg/TransformStamped", "geometry_msgs::msg::dds_::TransformStamped_",
     "RIHS01_0a241f87d04668d94099cbb5ba11691d5ad32c2f29682e4eb5653424bd275206",
     "std_msgs/Header header\n"
     "string child_frame_id\n"
     "Transform transform\n"},
    {"geometry_msgs/msg/Twist", "geometry_msgs::msg::dds_::Twist_",
     "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
     "Vector3 linear\n"
     "Vector3 angular\n"},
    {"geometry_msgs/msg/TwistStamped", "geometry_msgs::msg::dds_::TwistStamped_",
     "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
     "std_msgs/Header header\n"
     "Twist twist\n"},
    {"geometry_msgs/msg/Vector3", "geometry_msgs::msg::dds_::Vector3_",
     "RIHS01_cc12fe83e4c02719f1ce8070bfd14aecd40f75a96696a67a2a1f37f7dbb0765d",
     "float64 x\n"
     "float64 y\n"
     "float64 z\n"},
    {"moveit_msgs/msg/CollisionObject", "moveit_msgs::msg::dds_::CollisionObject_",
     "RIHS01_74b0acd6d56be032bf4f764b2c2633f50588b5fb2bd71e97206c59052747cf7e",
     "std_msgs/Header header\n"
     "geometry_msgs/Pose pose\n"
     "string id\n"
     "object_recognition_msgs/ObjectType type\n"
     "shape_msgs/SolidPrimitive[] primitives\n"
     "geometry_msgs/Pose[] primitive_poses\n"
     "shape_msgs/Mesh[] meshes\n"
     "geometry_msgs/Pose[] mesh_poses\n"
     "shape_msgs/Plane[] planes\n"
     "geometry_msgs/Pose[] plane_poses\n"
     "string[] subframe_names\n"
     "geometry_msgs/Pose[] subframe_poses\n"
     "byte operation\n"},
    {"object_recognition_msgs/msg/ObjectType", "object_recognition_msgs::msg::dds_::ObjectType_",
     "RIHS01_5eb3ee3976403366d7c50d7dbee8bec96b3bced1e752674a7194a35841632134",
     "string key\n"
     "string db\n"},
    {"prescene_msgs/msg/AlternativePose", "prescene_msgs::msg::dds_::AlternativePose_",
     "RIHS01_9954042cc8c1dcdef287801088d570ebb068354c7fe9d7b54f6ddfc2a9342d35",
     "geometry_msgs/Pose pose\n"
     "float64 probability\n"},
    {"prescene_msgs/msg/Answer", "prescene_msgs::msg::dds_::Answer_",
     "RIHS01_efcfd7be68d212ba34e9ac30edf2814b1bd0d3b8b0954267b31875117226cad2",
     "string id\n"
     "uint64 step\n"
     "string kind\n"
     "uint8 state\n"
     "string error\n"
     "string code\n"
     "Estimate[] estimates\n"
     "ObjectBelief[] objects\n"
     "uint64 instances\n"
     "bool converged\n"
     "string[] remarks\n"
     "string json\n"},
    {"prescene_msgs/msg/Belief", "prescene_msgs::msg::dds_::Belief_",
     "RIHS01_a945edb421d1568e31a97d0bc71e3afaaf36b11cbeffa93e17e6be0ddfcfab01",
     "std_msgs/Header header\n"
     "uint64 step\n"
     "ObjectBelief[] objects\n"
     "JointBelief[] joints\n"},
    {"prescene_msgs/msg/Cancel", "prescene_msgs::msg::dds_::Cancel_",
     "RIHS01_3b106f59f649925baad21471a0c005a2bff6d6e4904e12a2870193cd84782fe8",
     "string question\n"
     "string id\n"},
    {"prescene_msgs/msg/Estimate", "prescene_msgs::msg::dds_::Estimate_",
     "RIHS01_617c4b889e78cbbb96ee52e0593760df30e5c2889d48ea9514b0156fbb1d093e",
     "string name\n"
     "string group\n"
     "string subject\n"
     "string other\n"
     "float64 probability\n"
     "float64 low\n"
     "float64 high\n"},
    {"prescene_msgs/msg/Event", "prescene_msgs::msg::dds_::Event_",
     "RIHS01_317b24b1482d0fcc6aec00524d2bff630813521ac6c1f06341eb2514ad362607",
     "std_msgs/Header header\n"
     "uint64 step\n"
     "string event\n"
     "string object\n"
     "string support\n"
     "string camera\n"
     "string previous\n"
     "string current\n"
     "string reason\n"},
    {"prescene_msgs/msg/JointBelief", "prescene_msgs::msg::dds_::JointBelief_",
     "RIHS01_cd741e7c4e6bc7e3078b01008f41ed76b6ccea1f6abfd16c401941b083ae8e0d",
     "string name\n"
     "uint8 type\n"
     "float64 position\n"
     "float64 standard_deviation\n"
     "float64 velocity\n"
     "float64 lower\n"
     "float64 upper\n"
     "float64 confidence\n"},
    {"prescene_msgs/msg/ObjectBelief", "prescene_msgs::msg::dds_::ObjectBelief_",
     "RIHS01_b3cda5ad105cc5af49efe1e46687e47519944c09cfb017fb6c8b59d403ea2737",
     "string name\n"
     "string model\n"
     "uint8 state\n"
     "uint8 motion\n"
     "string held_by\n"
     "float64 confidence\n"
     "float64 existence\n"
     "float64 visible_share\n"
     "geometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/Twist twist\n"
     "ParameterEstimate[] parameters\n"
     "uint32 lessons\n"
     "builtin_interfaces/Time learned\n"
     "AlternativePose[] alternatives\n"
     "bool is_new\n"
     "geometry_msgs/Vector3 size\n"},
    {"prescene_msgs/msg/ParameterEstimate", "prescene_msgs::msg::dds_::ParameterEstimate_",
     "RIHS01_0e8b5962f09bc471709fd61a356003fe88c0205f3bd32da3fb920a573fc1bdd5",
     "string name\n"
     "float64 mean\n"
     "float64 standard_deviation\n"
     "float64 low\n"
     "float64 high\n"},
    {"prescene_msgs/msg/Progress", "prescene_msgs::msg::dds_::Progress_",
     "RIHS01_e220c0d7c00b83fe5465431a7646686c149ad49e662bbebdbbce6edd59266021",
     "string id\n"
     "float64 fraction\n"
     "string text\n"
     "float64 seconds_left\n"},
    {"prescene_msgs/msg/Query", "prescene_msgs::msg::dds_::Query_",
     "RIHS01_196f072494fe2853e1b4db466d62a2954ff7cd69fffa453b273b4e4d8fd8becc",
     "string id\n"
     "string kind\n"
     "string object\n"
     "float64 duration\n"
     "float64 max_seconds\n"
     "bool stream\n"
     "string[] detail\n"
     "string arguments\n"},
    {"rcl_interfaces/msg/FloatingPointRange", "rcl_interfaces::msg::dds_::FloatingPointRange_",
     "RIHS01_e6af23a23c177fee5f3075c8b1e435162a9b63c863d78c06017460b49684262d",
     "float64 from_value\n"
     "float64 to_value\n"
     "float64 step\n"},
    {"rcl_interfaces/msg/IntegerRange", "rcl_interfaces::msg::dds_::IntegerRange_",
     "RIHS01_f7b7fdc0f65f07702e099218e13288c3963bcb9345bde78b560e6cd19800fc5a",
     "int64 from_value\n"
     "int64 to_value\n"
     "uint64 step\n"},
    {"rcl_interfaces/msg/ListParametersResult", "rcl_interfaces::msg::dds_::ListParametersResult_",
     "RIHS01_237ae3428413dcbcfb452b510c42355f3a2b021dc091afa3e18526d57022f1cd",
     "string[] names\n"
     "string[] prefixes\n"},
    {"rcl_interfaces/msg/Parameter", "rcl_interfaces::msg::dds_::Parameter_",
     "RIHS01_ddfe6442cffc462317adb5c92536a7b6dd55858c5c3e1e328165a6b73c2831af",
     "string name\n"
     "ParameterValue value\n"},
    {"rcl_interfaces/msg/ParameterDescriptor", "rcl_interfaces::msg::dds_::ParameterDescriptor_",
     "RIHS01_52175dbfda6c51153101d33d2a9da05743f66f02d5ab2ca9ec4709b46b73d704",
     "string name\n"
     "uint8 type\n"
     "string description\n"
     "string additional_constraints\n"
     "bool read_only\n"
     "bool dynamic_typing\n"
     "FloatingPointRange[<=1] floating_point_range\n"
     "IntegerRange[<=1] integer_range\n"},
    {"rcl_interfaces/msg/ParameterEvent", "rcl_interfaces::msg::dds_::ParameterEvent_",
     "RIHS01_043e627780fcad87a22d225bc2a037361dba713fca6a6b9f4b869a5aa0393204",
     "builtin_interfaces/Time stamp\n"
     "string node\n"
     "Parameter[] new_parameters\n"
     "Parameter[] changed_parameters\n"
     "Parameter[] deleted_parameters\n"},
    {"rcl_interfaces/msg/ParameterValue", "rcl_interfaces::msg::dds_::ParameterValue_",
     "RIHS01_115fc089a387e23c7ecd3525c9189c379109119d6ab82e8dfbde0fdf6a7f9b68",
     "uint8 type\n"
     "bool bool_value\n"
     "int64 integer_value\n"
     "float64 double_value\n"
     "string string_value\n"
     "byte[] byte_array_value\n"
     "bool[] bool_array_value\n"
     "int64[] integer_array_value\n"
     "float64[] double_array_value\n"
     "string[] string_array_value\n"},
    {"rcl_interfaces/msg/SetParametersResult", "rcl_interfaces::msg::dds_::SetParametersResult_",
     "RIHS01_cfcc0fb0371ee5159b403960ef4300f8f9d2f1fd6117c8666b7f9654d528a9b1",
     "bool successful\n"
     "string reason\n"},
    {"rcl_interfaces/srv/DescribeParameters_Request", "rcl_interfaces::srv::dds_::DescribeParameters_Request_",
     "RIHS01_05dd1c2bc87dec2627105c8070d6f9725c781a4f2ab852975bf105462b82b644", "string[] names\n"},
    {"rcl_interfaces/srv/DescribeParameters_Response", "rcl_interfaces::srv::dds_::DescribeParameters_Response_",
     "RIHS01_ad6747319613c6131589e062e095b469a46cc764f7d0f12a001a49e6cd893995", "ParameterDescriptor[] descriptors\n"},
    {"rcl_interfaces/srv/GetParameterTypes_Request", "rcl_interfaces::srv::dds_::GetParameterTypes_Request_",
     "RIHS01_87d7ec5ef545d4daa289d500025d31fb2437bc8b8365ca367161c4dac4be33fd", "string[] names\n"},
    {"rcl_interfaces/srv/GetParameterTypes_Response", "rcl_interfaces::srv::dds_::GetParameterTypes_Response_",
     "RIHS01_ac1335dce67c478e669434f6ac2fbff34fcd529580f272d3006785ba8b54e47f", "uint8[] types\n"},
    {"rcl_interfaces/srv/GetParameters_Request", "rcl_interfaces::srv::dds_::GetParameters_Request_",
     "RIHS01_135a9e1c3d7cebef792f6687d7ddf99949b21a0bd9a320d863a9110a3f5cf4d6", "string[] names\n"},
    {"rcl_interfaces/srv/GetParameters_Response", "rcl_interfaces::srv::dds_::GetParameters_Response_",
     "RIHS01_9fa773b46e39cc5d02db6224d8fd520bb9caeeffc2b27c96c1e59431baba9f2a", "ParameterValue[] values\n"},
    {"rcl_interfaces/srv/ListParameters_Request", "rcl_interfaces::srv::dds_::ListParameters_Request_",
     "RIHS01_a1b0b5d6b967a5b8ac5bc8563c3ea678f349e312a6a4967227c5a96bc5ce38df",
     "string[] prefixes\n"
     "uint64 depth\n"},
    {"rcl_interfaces/srv/ListParameters_Response", "rcl_interfaces::srv::dds_::ListParameters_Response_",
     "RIHS01_31b937b82de3612426be79f231e386259f97e8dc843e3f2845288b4bfa296bdd", "ListParametersResult result\n"},
    {"rcl_interfaces/srv/SetParametersAtomically_Request",
     "rcl_interfaces::srv::dds_::SetParametersAtomically_Request_",
     "RIHS01_db0bd950ed5ed867a0e90b225e44dea382d762c0762ff3e0ee842190042a59e5", "Parameter[] parameters\n"},
    {"rcl_interfaces/srv/SetParametersAtomically_Response",
     "rcl_interfaces::srv::dds_::SetParametersAtomically_Response_",
     "RIHS01_31b1a38c5b0b9d893ee24da45f69638f4561c78461d82d52750f429b534502b8", "SetParametersResult result\n"},
    {"rcl_interfaces/srv/SetParameters_Request", "rcl_interfaces::srv::dds_::SetParameters_Request_",
     "RIHS01_130d46386b7e84ea9ecf60608a4d83cbe5e5cb7c6cc5b712b7a4e3a6c254e932", "Parameter[] parameters\n"},
    {"rcl_interfaces/srv/SetParameters_Response", "rcl_interfaces::srv::dds_::SetParameters_Response_",
     "RIHS01_7a0e8140a0b8d98308fa81a5403a766e610af29a239caf54b7553227906fc266", "SetParametersResult[] results\n"},
    {"rosgraph_msgs/msg/Clock", "rosgraph_msgs::msg::dds_::Clock_",
     "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564", "builtin_interfaces/Time clock\n"},
    {"sensor_msgs/msg/CameraInfo", "sensor_msgs::msg::dds_::CameraInfo_",
     "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "string distortion_model\n"
     "float64[] d\n"
     "float64[9] k\n"
     "float64[9] r\n"
     "float64[12] p\n"
     "uint32 binning_x\n"
     "uint32 binning_y\n"
     "RegionOfInterest roi\n"},
    {"sensor_msgs/msg/CompressedImage", "sensor_msgs::msg::dds_::CompressedImage_",
     "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a",
     "std_msgs/Header header\n"
     "string format\n"
     "uint8[] data\n"},
    {"sensor_msgs/msg/Image", "sensor_msgs::msg::dds_::Image_",
     "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "string encoding\n"
     "uint8 is_bigendian\n"
     "uint32 step\n"
     "uint8[] data\n"},
    {"sensor_msgs/msg/JointState", "sensor_msgs::msg::dds_::JointState_",
     "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
     "std_msgs/Header header\n"
     "string[] name\n"
     "float64[] position\n"
     "float64[] velocity\n"
     "float64[] effort\n"},
    {"sensor_msgs/msg/PointCloud2", "sensor_msgs::msg::dds_::PointCloud2_",
     "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
     "std_msgs/Header header\n"
     "uint32 height\n"
     "uint32 width\n"
     "PointField[] fields\n"
     "bool is_bigendian\n"
     "uint32 point_step\n"
     "uint32 row_step\n"
     "uint8[] data\n"
     "bool is_dense\n"},
    {"sensor_msgs/msg/PointField", "sensor_msgs::msg::dds_::PointField_",
     "RIHS01_5c6a4750728c2bcfbbf7037225b20b02d4429634732146b742dee1726637ef01",
     "string name\n"
     "uint32 offset\n"
     "uint8 datatype\n"
     "uint32 count\n"},
    {"sensor_msgs/msg/RegionOfInterest", "sensor_msgs::msg::dds_::RegionOfInterest_",
     "RIHS01_ad16bcba5f9131dcdba6fbded19f726f5440e3c513b4fb586dd3027eeed8abb1",
     "uint32 x_offset\n"
     "uint32 y_offset\n"
     "uint32 height\n"
     "uint32 width\n"
     "bool do_rectify\n"},
    {"shape_msgs/msg/Mesh", "shape_msgs::msg::dds_::Mesh_",
     "RIHS01_f2150b82d8ee7e8bc3f396a2b158aefb4b9a5510a474be271ba1268aebb55289",
     "MeshTriangle[] triangles\n"
     "geometry_msgs/Point[] vertices\n"},
    {"shape_msgs/msg/MeshTriangle", "shape_msgs::msg::dds_::MeshTriangle_",
     "RIHS01_618e5c073eeb729e433ef6226e72c01d995c459fb7d76348c9700409a5020bd0", "uint32[3] vertex_indices\n"},
    {"shape_msgs/msg/Plane", "shape_msgs::msg::dds_::Plane_",
     "RIHS01_dfbfe8314689c850615d4a727af017e9aa86c10e369a606c8c851ef8f16c58c8", "float64[4] coef\n"},
    {"shape_msgs/msg/SolidPrimitive", "shape_msgs::msg::dds_::SolidPrimitive_",
     "RIHS01_2802a15190aadc3f496584df4b0b4c5824d8a0b31aaef839faa75bc34dda38ac",
     "uint8 type\n"
     "float64[<=3] dimensions\n"
     "geometry_msgs/Polygon polygon\n"},
    {"std_msgs/msg/ColorRGBA", "std_msgs::msg::dds_::ColorRGBA_",
     "RIHS01_77a7a5b9ae477306097665106e0413ba74440245b1f3d0c6d6405fe5c7813fe8",
     "float32 r\n"
     "float32 g\n"
     "float32 b\n"
     "float32 a\n"},
    {"std_msgs/msg/Header", "std_msgs::msg::dds_::Header_",
     "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01",
     "builtin_interfaces/Time stamp\n"
     "string frame_id\n"},
    {"std_msgs/msg/String", "std_msgs::msg::dds_::String_",
     "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18", "string data\n"},
    {"tf2_msgs/msg/TFMessage", "tf2_msgs::msg::dds_::TFMessage_",
     "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
     "geometry_msgs/TransformStamped[] transforms\n"},
    {"vision_msgs/msg/BoundingBox3D", "vision_msgs::msg::dds_::BoundingBox3D_",
     "RIHS01_bbb73a65c163d7f9bb29009c7bde9f7faa576bd2d23299c4511d19230dab4698",
     "geometry_msgs/Pose center\n"
     "geometry_msgs/Vector3 size\n"},
    {"vision_msgs/msg/Detection3D", "vision_msgs::msg::dds_::Detection3D_",
     "RIHS01_ddd703be132ab0b69d33121f1bb034132bfbb3b0ac5f9fb1516005ba1c8a265b",
     "std_msgs/Header header\n"
     "ObjectHypothesisWithPose[] results\n"
     "BoundingBox3D bbox\n"
     "string id\n"},
    {"vision_msgs/msg/Detection3DArray", "vision_msgs::msg::dds_::Detection3DArray_",
     "RIHS01_793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018",
     "std_msgs/Header header\n"
     "Detection3D[] detections\n"},
    {"vision_msgs/msg/ObjectHypothesis", "vision_msgs::msg::dds_::ObjectHypothesis_",
     "RIHS01_51da43cec11c01957a64d1e05a24acd18aae7745ec30b74348ad5f6d634f7f90",
     "string class_id\n"
     "float64 score\n"},
    {"vision_msgs/msg/ObjectHypothesisWithPose", "vision_msgs::msg::dds_::ObjectHypothesisWithPose_",
     "RIHS01_41c12344c0396c48b81df12467c192d99b2a0eb1463c5c37194e4223251c80bc",
     "ObjectHypothesis hypothesis\n"
     "geometry_msgs/PoseWithCovariance pose\n"},
    {"visualization_msgs/msg/Marker", "visualization_msgs::msg::dds_::Marker_",
     "RIHS01_45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0",
     "std_msgs/Header header\n"
     "string ns\n"
     "int32 id\n"
     "int32 type\n"
     "int32 action\n"
     "geometry_msgs/Pose pose\n"
     "geometry_msgs/Vector3 scale\n"
     "std_msgs/ColorRGBA color\n"
     "builtin_interfaces/Duration lifetime\n"
     "bool frame_locked\n"
     "geometry_msgs/Point[] points\n"
     "std_msgs/ColorRGBA[] colors\n"
     "string texture_resource\n"
     "sensor_msgs/CompressedImage texture\n"
     "UVCoordinate[] uv_coordinates\n"
     "string text\n"
     "string mesh_resource\n"
     "MeshFile mesh_file\n"
     "bool mesh_use_embedded_materials\n"},
    {"visualization_msgs/msg/MarkerArray", "visualization_msgs::msg::dds_::MarkerArray_",
     "RIHS01_86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf", "Marker[] markers\n"},
    {"visualization_msgs/msg/MeshFile", "visualization_msgs::msg::dds_::MeshFile_",
     "RIHS01_7710ece15a148fb7c9b546364cfb215bb06098087bd6394fe5b73a493508f8c4",
     "string filename\n"
     "uint8[] data\n"},
    {"visualization_msgs/msg/UVCoordinate", "visualization_msgs::msg::dds_::UVCoordinate_",
     "RIHS01_f27f7ed21fe360c6066944f856b801a0c0d1e94e815b6886444b42d90b196a26",
     "float32 u\n"
     "float32 v\n"},
}};

}  // namespace

std::span<const RosType> ros_types() { return kTypes; }

}  // namespace prescene::interfaces
