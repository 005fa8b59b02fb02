// SPDX-License-Identifier: Apache-2.0
// glTF and COLLADA: documents that refer to their own parts.
#include <functional>

#include "crafted_meshes.h"

namespace prescene::tests {

using nlohmann::ordered_json;

// ------------------------------------------------------------------------------------------------- glTF, GLB

ordered_json sound_gltf() {
  // One triangle (0,0,0), (1,0,0), (0,1,0), then its indices 0, 1, 2 in 16 bits.
  return ordered_json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
 "nodes":[{"mesh":0,"translation":[0,0,5],"children":[1]},{"mesh":0,"rotation":[0,0,0,1],"scale":[1,1,-1]}],
 "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],
 "accessors":[{"bufferView":0,"byteOffset":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
              {"bufferView":1,"byteOffset":0,"componentType":5123,"count":3,"type":"SCALAR"}],
 "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36,"byteStride":12},{"buffer":0,"byteOffset":36,"byteLength":6}],
 "buffers":[{"byteLength":44,
             "uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIAAAA="}]})");
}

std::string sound_buffer() {
  return std::string(12, '\0') + bytes_of(1.0F) + std::string(12, '\0') + bytes_of(1.0F) + std::string(4, '\0') +
         std::string("\0\0\1\0\2\0\0\0", 8);
}

std::string glb_of(ordered_json document, std::string buffer) {
  if (document.is_object() && document.contains("buffers") && document["buffers"].is_array() &&
      !document["buffers"].empty() && document["buffers"][0].is_object() && document["buffers"][0].contains("uri") &&
      document["buffers"][0]["uri"].get<std::string>().starts_with("data:"))
    document["buffers"][0].erase("uri");
  std::string json = document.dump();
  json.resize((json.size() + 3) / 4 * 4, ' ');
  buffer.resize((buffer.size() + 3) / 4 * 4, '\0');
  return "glTF" + bytes_of(2U) + bytes_of(static_cast<std::uint32_t>(28 + json.size() + buffer.size())) +
         bytes_of(static_cast<std::uint32_t>(json.size())) + "JSON" + json +
         bytes_of(static_cast<std::uint32_t>(buffer.size())) + std::string("BIN\0", 4) + buffer;
}

namespace {
std::vector<ordered_json> crafted_documents() {
  std::vector<ordered_json> documents;
  const auto add = [&](const std::function<void(ordered_json&)>& change) {
    ordered_json document = sound_gltf();
    change(document);
    documents.push_back(std::move(document));
  };
  add([](ordered_json& d) { d["nodes"][0]["children"] = {0}; });
  add([](ordered_json& d) { d["nodes"][1]["children"] = {0}; });
  add([](ordered_json& d) {  // Nested 50,000 deep.
    d["nodes"] = ordered_json::array();
    for (int i = 1; i <= 50'000; ++i) d["nodes"].push_back({{"children", {i}}});
    d["nodes"].push_back({{"mesh", 0}});
  });
  add([](ordered_json& d) {  // 2^40 nodes by way of 41.
    d["nodes"] = ordered_json::array();
    for (int i = 1; i <= 40; ++i) d["nodes"].push_back({{"children", {i, i}}});
    d["nodes"].push_back({{"mesh", 0}});
  });
  add([](ordered_json& d) { d["scenes"][0]["nodes"] = std::vector<int>(1'000'000, 1); });
  for (const char* uri : {"pipe", "folder", "../pipe", "none.bin", "/dev/zero", "/dev/stdin", "/proc/self/mem",
                          "file:///etc/passwd", "", ".", "http://localhost/x", "data:application/octet-stream;base64,",
                          "data:,", "data:application/octet-stream;base64,@@@@", "%00", "../../../../../../etc/passwd"})
    add([&](ordered_json& d) { d["buffers"][0]["uri"] = uri; });
  add([](ordered_json& d) { d["images"] = {{{"uri", "pipe"}}, {{"bufferView", 7}, {"mimeType", "image/png"}}}; });
  for (const char* type : {"SCALAR", "MAT4", "VEC9", ""})
    add([&](ordered_json& d) { d["accessors"][0]["type"] = type; });
  for (const int mode : {0, 1, 2, 3, 5, 6, 7, -1}) {
    add([&](ordered_json& d) { d["meshes"][0]["primitives"][0]["mode"] = mode; });
  }
  add([](ordered_json& d) { d["accessors"][0].erase("bufferView"); });
  add([](ordered_json& d) {
    d["accessors"][0]["sparse"] = {{"count", 4'000'000'000},
                                   {"indices", {{"bufferView", 1}, {"componentType", 5125}}},
                                   {"values", {{"bufferView", 0}}}};
  });
  add([](ordered_json& d) { d["extensionsRequired"] = {"KHR_draco_mesh_compression"}; });
  add([](ordered_json& d) { d["asset"]["version"] = "1.0"; });
  add([](ordered_json& d) { d["skins"] = {{{"joints", {0, 1, 7}}, {"inverseBindMatrices", 0}}}; });
  add([](ordered_json& d) {
    d["animations"] = {{{"channels", {{{"sampler", 9}}}}, {"samplers", ordered_json::array()}}};
  });
  add([](ordered_json& d) { d["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 9}}}; });
  // Every number in turn, and what is no number.
  const std::vector<ordered_json> odd = {-1,  4'000'000'000, 1, 0x7fffffff,           1e308,
                                         "x", nullptr,       0, ordered_json::array()};
  std::vector<ordered_json::json_pointer> places;
  const ordered_json flat = sound_gltf().flatten();
  for (const auto& [place, value] : flat.items()) {
    if (value.is_number()) places.emplace_back(place);
  }
  for (std::size_t i = 0; documents.size() < kLeastCrafted + 10; ++i) {
    add([&](ordered_json& d) { d[places[i % places.size()]] = odd[(i / places.size() + i) % odd.size()]; });
  }
  return documents;
}
}  // namespace

std::vector<std::string> crafted_gltf() {
  std::vector<std::string> files;
  for (const ordered_json& document : crafted_documents()) files.push_back(document.dump());
  const std::string sound = sound_gltf().dump();
  files.push_back("");
  files.push_back("{");
  files.push_back("[]");
  files.push_back("null");
  files.push_back(repeated("[", 2'000'000));
  files.push_back(R"({"extras":)" + repeated("[", 2'000'000) + repeated("]", 2'000'000) + "," + sound.substr(1));
  files.push_back(R"({"extras":)" + repeated("{\"a\":", 500'000) + "1" + repeated("}", 500'000) + "," +
                  sound.substr(1));
  files.push_back(sound.substr(0, sound.size() / 2));
  files.push_back(sound + sound);
  files.push_back("\xef\xbb\xbf" + sound);
  files.push_back(glb_of(sound_gltf(), sound_buffer()));
  return files;
}

std::vector<std::string> crafted_glb() {
  std::vector<std::string> files;
  for (const ordered_json& document : crafted_documents()) files.push_back(glb_of(document, sound_buffer()));
  const std::string sound = glb_of(sound_gltf(), sound_buffer());
  files.push_back(sound.substr(0, 12));
  files.push_back(sound.substr(0, sound.size() - 1));
  files.push_back(sound.substr(0, 40));
  files.push_back(sound + std::string(1'000'000, '\0'));
  files.push_back(glb_of(sound_gltf(), ""));
  files.push_back(sound_gltf().dump());
  for (const std::size_t place : {4, 8, 12, 16}) {
    for (const std::uint32_t word : {0U, 1U, 0x7fffffffU, 0xffffffffU, 0xfffffff0U}) {
      std::string file = sound;
      files.push_back(file.replace(place, 4, bytes_of(word)));
    }
  }
  return files;
}

// ------------------------------------------------------------------------------------------------- COLLADA

std::string sound_collada() {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="9">10 20 30 40 20 30 10 50 30</float_array>
<technique_common><accessor source="#a" count="3" stride="3" offset="0"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>
</vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>
</library_geometries><library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
<library_visual_scenes><visual_scene id="s"><node><translate>0 0 1</translate>
<instance_geometry url="#g"/></node><node><instance_node url="#n"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

std::string collada_polygons() {
  return replaced(
      sound_collada(),
      R"(<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>)",
      R"(<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3</vcount><p>0 1 2</p></polylist>)");
}

std::vector<std::string> crafted_collada() {
  const std::string sound = sound_collada();
  const std::string polygons = collada_polygons();
  const std::string inside = R"(<instance_geometry url="#g"/></node></library_nodes>)";
  std::string graph = R"(<node id="n"><instance_geometry url="#g"/></node>)";
  for (int i = 0; i < 30; ++i) {
    const std::string next = i == 0 ? "n" : "n" + std::to_string(i);
    const std::string instance = "<instance_node url=\"#" + next + "\"/>";
    graph += "<node id=\"n" + std::to_string(i + 1) + "\">" + instance + instance + "</node>";
  }
  std::vector<std::string> files = {
      "",
      "<COLLADA>",
      "<?xml version=\"1.0\"?>",
      repeated("<a>", 1'000'000),
      sound.substr(0, sound.size() / 2),
      replaced(sound, inside, R"(<instance_node url="#n"/></node></library_nodes>)"),
      replaced(sound, inside, R"(<node id="m"><instance_node url="#n"/></node></node></library_nodes>)"),
      replaced(replaced(sound, R"(<node id="n"><instance_geometry url="#g"/></node>)", graph),
               R"(<instance_node url="#n"/></node></visual_scene>)",
               R"(<instance_node url="#n30"/></node></visual_scene>)"),
      replaced(sound, "<node><translate>",
               repeated("<node>", 50'000) + repeated("</node>", 50'000) + "<node><translate>"),
      replaced(sound, "<library_nodes>",
               repeated("<extra>", 100'000) + repeated("</extra>", 100'000) + "<library_nodes>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>" + repeated("0 1 2 ", 500'000) + "</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 4000000000</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>-1 -2 -3</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p></p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 2 0 1</p>"),
      replaced(sound, R"(<p>0 1 2</p>)", "<p>0 1 3</p>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>4000000000</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>-3</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount>0 0 0 3</vcount>"),
      replaced(polygons, "<vcount>3</vcount>", "<vcount></vcount>"),
      replaced(polygons, R"(<polylist count="1">)", R"(<polylist count="4000000000">)"),
      replaced(sound, R"(stride="3")", R"(stride="4000000000")"),
      replaced(sound, R"(stride="3")", R"(stride="0")"),
      replaced(sound, R"(stride="3")", R"(stride="-3")"),
      replaced(sound, R"(stride="3" offset="0")", R"(stride="3" offset="4000000000")"),
      replaced(sound, R"(count="3" stride)", R"(count="4000000000" stride)"),
      replaced(sound, R"(count="9")", R"(count="4000000000")"),
      replaced(sound, R"(offset="0"/><p>)", R"(offset="4000000000"/><p>)"),
      replaced(sound, R"(offset="0"/><p>)", R"(offset="1000000"/><p>)"),
      replaced(sound, "#g", "#none"),
      replaced(sound, "#a", "#none"),
      replaced(sound, "#p", "#p2"),
      replaced(sound, "#v\"", "#g\""),
      replaced(sound, "#s", "file:///dev/zero#s"),
      replaced(sound, "#g", "pipe#g"),
      replaced(sound, "<?xml version=\"1.0\"?>",
               "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY b SYSTEM \"pipe\"><!ENTITY c \"&b;&b;\">]>"),
      replaced(sound, "Z_UP", "&c;"),
      replaced(
          sound, "<library_geometries>",
          R"(<library_images><image id="i"><init_from>pipe</init_from></image></library_images><library_geometries>)"),
      replaced(sound, "<translate>0 0 1</translate>", "<matrix>1 2 3</matrix>"),
      replaced(sound, "<translate>0 0 1</translate>", "<matrix>" + repeated("nan ", 16) + "</matrix>"),
      replaced(sound, R"(<float_array id="a" count="9">)", R"(<float_array id="a" count="9">x)"),
      replaced(sound, "10 20 30 40 20 30 10 50 30", "10 20 30"),
      replaced(sound, "10 20 30 40 20 30 10 50 30", repeated("1 ", 1'000'000)),
      sound + sound,
      std::string(1'000'000, '\0'),
      "\xff\xfe" + sound,
  };
  add_odd_numbers(polygons, &files);
  return files;
}

}  // namespace prescene::tests
