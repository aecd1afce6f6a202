#include "tests/scenes/encode_mesh.h"

#include <draco/compression/encode.h>
#include <meshoptimizer.h>

#include <cstring>
#include <stdexcept>

namespace gonio::test {
namespace {

// values: `components` floats a point.
void add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, int components,
                   const std::vector<float>& values) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, static_cast<std::uint8_t>(components), draco::DT_FLOAT32, false,
                   static_cast<std::int64_t>(sizeof(float)) * components, 0);
    const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
    for (std::uint32_t i = 0; i < mesh.num_points(); ++i)
        mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(i),
                                              &values[std::size_t{i} * static_cast<std::size_t>(components)]);
}

std::string text_of(const std::vector<unsigned char>& bytes) {
    return {bytes.begin(), bytes.end()};
}

}  // namespace

EncodedDraco encode_draco(const Mesh& from, int position_bits, bool sequential) {
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<std::uint32_t>(from.vertices.size()));
    std::vector<float> positions, normals, uvs;
    for (const Vertex& vertex : from.vertices) {
        for (int k = 0; k < 3; ++k) positions.push_back(vertex.position[k]), normals.push_back(vertex.normal[k]);
        for (int k = 0; k < 2; ++k) uvs.push_back(vertex.uv[k]);
    }
    add_attribute(mesh, draco::GeometryAttribute::POSITION, 3, positions);
    add_attribute(mesh, draco::GeometryAttribute::NORMAL, 3, normals);
    add_attribute(mesh, draco::GeometryAttribute::TEX_COORD, 2, uvs);
    for (std::size_t i = 0; i + 2 < from.indices.size(); i += 3)
        mesh.AddFace({draco::PointIndex(from.indices[i]), draco::PointIndex(from.indices[i + 1]),
                      draco::PointIndex(from.indices[i + 2])});
    draco::Encoder encoder;
    encoder.SetEncodingMethod(sequential ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
    encoder.SetTrackEncodedProperties(true);
    if (position_bits > 0) encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, position_bits);
    draco::EncoderBuffer buffer;
    const draco::Status status = encoder.EncodeMeshToBuffer(mesh, &buffer);
    if (!status.ok()) throw std::runtime_error(status.error_msg_string());
    return {{buffer.data(), buffer.size()}, encoder.num_encoded_points(), encoder.num_encoded_faces()};
}

std::string encode_meshopt_vertices(const std::string& bytes, std::size_t count, std::size_t stride) {
    std::vector<unsigned char> encoded(meshopt_encodeVertexBufferBound(count, stride));
    encoded.resize(meshopt_encodeVertexBuffer(encoded.data(), encoded.size(), bytes.data(), count, stride));
    return text_of(encoded);
}

std::string encode_meshopt_triangles(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    std::vector<unsigned char> encoded(meshopt_encodeIndexBufferBound(indices.size(), vertices));
    encoded.resize(meshopt_encodeIndexBuffer(encoded.data(), encoded.size(), indices.data(), indices.size()));
    return text_of(encoded);
}

std::string encode_meshopt_sequence(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    std::vector<unsigned char> encoded(meshopt_encodeIndexSequenceBound(indices.size(), vertices));
    encoded.resize(meshopt_encodeIndexSequence(encoded.data(), encoded.size(), indices.data(), indices.size()));
    return text_of(encoded);
}

std::string filter_octahedral(const std::vector<glm::vec3>& units) {
    std::vector<glm::vec4> padded;
    for (const glm::vec3& unit : units) padded.emplace_back(unit, 0.0f);
    std::string bytes(units.size() * 4, '\0');
    meshopt_encodeFilterOct(bytes.data(), units.size(), 4, 8, &padded[0].x);
    return bytes;
}

std::string filter_exponential(const std::vector<glm::vec3>& values, int bits) {
    std::string bytes(values.size() * sizeof(glm::vec3), '\0');
    meshopt_encodeFilterExp(bytes.data(), values.size(), sizeof(glm::vec3), bits, &values[0].x);
    return bytes;
}

}  // namespace gonio::test
