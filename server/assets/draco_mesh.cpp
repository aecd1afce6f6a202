#include "server/assets/draco_mesh.h"

#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/varint_decoding.h>

#include <cstring>
#include <optional>

namespace gonio {
namespace {

constexpr std::uint16_t kVersion2_0 = DRACO_BITSTREAM_VERSION(2, 0), kVersion2_2 = DRACO_BITSTREAM_VERSION(2, 2);

// What the decoder allocates for each corner of a face, and for each with every set of seams, rounded up.
constexpr std::size_t kBytesOfCorner = 24, kBytesOfSeamedCorner = 16;

// What a bitstream says of its size before its connectivity.
struct Sizes {
    std::uint32_t faces = 0, vertices = 0, symbols = 0, splits = 0;
    std::uint8_t seams = 0;  // sets of attributes with seams of their own
};

bool read_count(draco::DecoderBuffer& buffer, bool fixed, std::uint32_t& count) {
    return fixed ? buffer.Decode(&count) : draco::DecodeVarint(&count, &buffer);
}

// The first numbers of the connectivity (Draco bitstream 2.2, 4.1 "Connectivity"; older ones with fixed words). buffer
// is a copy: the decoder reads them again.
bool read_sizes(draco::DecoderBuffer buffer, const draco::MeshEdgebreakerDecoder&, Sizes& sizes) {
    const bool fixed = buffer.bitstream_version() < kVersion2_0;
    std::uint32_t unused = 0;
    if (buffer.bitstream_version() < kVersion2_2 && !read_count(buffer, fixed, unused)) return false;
    return read_count(buffer, fixed, sizes.vertices) && read_count(buffer, fixed, sizes.faces) &&
           buffer.Decode(&sizes.seams) && read_count(buffer, fixed, sizes.symbols) &&
           read_count(buffer, fixed, sizes.splits);
}

bool read_sizes(draco::DecoderBuffer buffer, const draco::MeshSequentialDecoder&, Sizes& sizes) {
    const bool fixed = buffer.bitstream_version() < kVersion2_2;
    return read_count(buffer, fixed, sizes.faces) && read_count(buffer, fixed, sizes.vertices);
}

// A decoder that asks before it allocates: first by the counts of the bitstream, then by its attributes.
template <typename Decoder>
class Bounded final : public Decoder {
public:
    explicit Bounded(const DracoBounds& bounds) : bounds_(bounds) {}

    std::string too_large;  // what was too large, if anything

protected:
    bool DecodeConnectivity() override {
        Sizes sizes;
        if (!read_sizes(*this->buffer(), *this, sizes)) return false;
        if (sizes.faces > bounds_.faces) return refuse(std::to_string(sizes.faces) + " faces");
        const std::size_t corners = 3 * std::size_t{sizes.faces};
        if (sizes.vertices > bounds_.points) return refuse(std::to_string(sizes.vertices) + " vertices");
        if (sizes.symbols > corners || sizes.splits > corners) return refuse("its list of splits");
        const std::size_t corner_bytes = kBytesOfCorner + kBytesOfSeamedCorner * sizes.seams;
        if (corners > bounds_.bytes / corner_bytes) return refuse(std::to_string(sizes.faces) + " faces");
        if (!Decoder::DecodeConnectivity()) return false;
        const std::size_t points = this->mesh()->num_points();
        return points <= bounds_.points || refuse(std::to_string(points) + " points");
    }

    bool DecodeAllAttributes() override {
        std::size_t point_bytes = 0;
        for (int i = 0; i < this->mesh()->num_attributes(); ++i) {
            const draco::PointAttribute& attribute = *this->mesh()->attribute(i);
            // Values as stored, the integers they are decoded from, and which value a point has.
            point_bytes += attribute.byte_stride() + 4 * std::size_t{attribute.num_components()} + 4;
        }
        if (point_bytes > 0 && this->mesh()->num_points() > bounds_.bytes / point_bytes)
            return refuse(std::to_string(this->mesh()->num_attributes()) + " attributes");
        return Decoder::DecodeAllAttributes();
    }

private:
    bool refuse(std::string what) {
        too_large = std::move(what);
        return false;
    }

    DracoBounds bounds_;
};

template <typename Decoder>
std::optional<Error> decode_with(draco::DecoderBuffer& buffer, draco::Mesh& mesh, const DracoBounds& bounds,
                                 const std::string& where) {
    Bounded<Decoder> decoder(bounds);
    const draco::DecoderOptions options;
    const draco::Status status = decoder.Decode(options, &buffer, &mesh);
    if (!decoder.too_large.empty())
        return Error{"too_large", where, decoder.too_large,
                     "the Draco mesh is far larger than its accessors say, or than memory"};
    if (!status.ok()) return Error{"bad_gltf", where, status.error_msg_string(), "the Draco mesh cannot be decoded"};
    return std::nullopt;
}

// The values of all points as T. Result: false where one does not fit into T.
template <typename T>
bool convert(const draco::PointAttribute& from, std::size_t points, std::vector<std::byte>& to) {
    const std::size_t components = from.num_components();
    to.resize(points * components * sizeof(T));
    std::vector<T> values(components);
    for (std::size_t i = 0; i < points; ++i) {
        const auto value = from.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
        if (value.value() >= from.size() || !from.ConvertValue<T>(value, values.data())) return false;
        std::memcpy(&to[i * components * sizeof(T)], values.data(), components * sizeof(T));
    }
    return true;
}

bool convert(const draco::PointAttribute& from, int component_type, std::size_t points, std::vector<std::byte>& to) {
    switch (component_type) {
        case 5120:
            return convert<std::int8_t>(from, points, to);
        case 5121:
            return convert<std::uint8_t>(from, points, to);
        case 5122:
            return convert<std::int16_t>(from, points, to);
        case 5123:
            return convert<std::uint16_t>(from, points, to);
        case 5125:
            return convert<std::uint32_t>(from, points, to);
        default:
            return convert<float>(from, points, to);
    }
}

}  // namespace

Result<DracoMesh> decode_draco(std::span<const std::byte> bytes, std::span<const DracoAttribute> wanted,
                               const DracoBounds& bounds, const std::string& where) {
    const auto bad = [&](std::string value, std::string message) {
        return Error{"bad_gltf", where, std::move(value), std::move(message)};
    };
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    draco::DracoHeader header;
    draco::DecoderBuffer peeked = buffer;
    if (!draco::PointCloudDecoder::DecodeHeader(&peeked, &header).ok() || header.encoder_type != draco::TRIANGULAR_MESH)
        return bad("", "these are no triangles in Draco's format");
    draco::Mesh mesh;
    const auto error = header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING
                           ? decode_with<draco::MeshSequentialDecoder>(buffer, mesh, bounds, where)
                           : decode_with<draco::MeshEdgebreakerDecoder>(buffer, mesh, bounds, where);
    if (error) return *error;

    DracoMesh result;
    result.points = mesh.num_points();
    result.indices.reserve(3 * std::size_t{mesh.num_faces()});
    for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
        for (const draco::PointIndex& point : mesh.face(draco::FaceIndex(f))) {
            if (point.value() >= result.points) return bad(std::to_string(point.value()), "a face has no such point");
            result.indices.push_back(point.value());
        }
    }
    for (const DracoAttribute& attribute : wanted) {
        const std::string id = std::to_string(attribute.id);
        const draco::PointAttribute* const from = mesh.GetAttributeByUniqueId(attribute.id);
        if (!from) return bad(id, "the Draco mesh has no such attribute");
        if (from->num_components() != attribute.components)
            return bad(id, "the Draco attribute has " + std::to_string(from->num_components()) +
                               " components, its accessor " + std::to_string(attribute.components));
        if (!convert(*from, attribute.component_type, result.points, result.attributes.emplace_back()))
            return bad(id, "a value of the Draco attribute does not fit into its accessor's component type");
    }
    return result;
}

}  // namespace gonio
