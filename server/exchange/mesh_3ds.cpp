#include "server/exchange/mesh_3ds.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>

#include "ies/core/srgb.h"

namespace gonio::exchange {
namespace {

// Chunks by the names of 3D Studio's file toolkit.
enum : std::uint16_t {
    kColorFloat = 0x0010,
    kColor24 = 0x0011,
    kLinearColor24 = 0x0012,
    kLinearColorFloat = 0x0013,
    kMeshData = 0x3D3D,
    kNamedObject = 0x4000,
    kTriangleObject = 0x4100,
    kPoints = 0x4110,
    kFaces = 0x4120,
    kFaceMaterial = 0x4130,
    kFile = 0x4D4D,
    kMaterialName = 0xA000,
    kMaterialDiffuse = 0xA020,
    kMaterial = 0xAFFF,
};
constexpr std::size_t kHeaderBytes = 6;  // identifier and length, which counts them

std::uint16_t u16(std::string_view bytes, std::size_t at) {
    return static_cast<std::uint16_t>(static_cast<unsigned char>(bytes[at]) | static_cast<unsigned char>(bytes[at + 1])
                                                                                  << 8);
}
std::uint32_t u32(std::string_view bytes, std::size_t at) {
    return u16(bytes, at) | static_cast<std::uint32_t>(u16(bytes, at + 2)) << 16;
}
float f32(std::string_view bytes, std::size_t at) {
    const std::uint32_t bits = u32(bytes, at);
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
}

// One object's points and faces, until both are known.
struct Object {
    std::vector<glm::vec3> points;
    std::vector<std::uint16_t> corners;  // 3 a face
    std::vector<int> materials;          // a face
};

struct Reading {
    std::string_view file;
    Mesh3ds mesh{};
    std::map<std::string, int, std::less<>> material_of{};
    std::map<int, std::size_t> part_of{};  // by material
    std::size_t points = 0, faces = 0;
    bool sized = false;

    std::size_t place(std::string_view chunk) const { return static_cast<std::size_t>(chunk.data() - file.data()); }
    Error bad(std::string_view at, const char* message) const {
        return {"bad_3ds", "byte " + std::to_string(place(at)), "", message};
    }
    static Error too_large(const char* what, std::size_t most) {
        return {"too_large", "", "", "a 3DS file has at most " + std::to_string(most) + " " + what};
    }
};

// Calls take(identifier, content) for each chunk. Fewer than six bytes at the end are no chunk.
template <typename Take>
std::optional<Error> each_chunk(const Reading& reading, std::string_view list, const Take& take) {
    while (list.size() >= kHeaderBytes) {
        const std::size_t length = u32(list, 2);
        if (length < kHeaderBytes || length > list.size())
            return reading.bad(list, "a chunk is longer than what it lies in");
        if (auto error = take(u16(list, 0), list.substr(kHeaderBytes, length - kHeaderBytes))) return error;
        list.remove_prefix(length);
    }
    return std::nullopt;
}

// A text that a zero ends, and what follows it.
std::pair<std::string_view, std::string_view> split_text(std::string_view content) {
    const std::size_t end = content.find('\0');
    if (end == std::string_view::npos) return {content, {}};
    return {content.substr(0, end), content.substr(end + 1)};
}

int material_named(Reading& reading, std::string_view name) {
    if (const auto found = reading.material_of.find(name); found != reading.material_of.end()) return found->second;
    if (reading.mesh.materials.size() >= kMax3dsMaterials) return -1;
    const int index = static_cast<int>(reading.mesh.materials.size());
    reading.mesh.materials.push_back({std::string(name.substr(0, 128)), glm::vec3(0.5f)});
    reading.material_of.emplace(std::string(name), index);
    return index;
}

std::optional<Error> read_material(Reading& reading, std::string_view content) {
    std::string_view name;
    glm::vec3 color(0.5f);
    auto error = each_chunk(reading, content, [&](std::uint16_t id, std::string_view inside) -> std::optional<Error> {
        if (id == kMaterialName) name = split_text(inside).first;
        if (id != kMaterialDiffuse) return std::nullopt;
        bool is_linear = false;  // a linear colour goes before one that is encoded
        return each_chunk(reading, inside, [&](std::uint16_t kind, std::string_view value) -> std::optional<Error> {
            const bool bytes = (kind == kColor24 || kind == kLinearColor24) && value.size() >= 3;
            const bool floats = (kind == kColorFloat || kind == kLinearColorFloat) && value.size() >= 12;
            const bool encoded = kind == kColor24 || kind == kColorFloat;
            if ((!bytes && !floats) || (encoded && is_linear)) return std::nullopt;
            is_linear = !encoded;
            for (int i = 0; i < 3; ++i) {
                const std::size_t at = static_cast<std::size_t>(i);
                const double read =
                    bytes ? static_cast<unsigned char>(value[at]) / 255.0 : static_cast<double>(f32(value, 4 * at));
                const double kept = std::isfinite(read) ? std::clamp(read, 0.0, 1.0) : 0.5;
                color[i] = static_cast<float>(encoded ? linear_of_srgb(kept) : kept);
            }
            return std::nullopt;
        });
    });
    if (error) return error;
    if (reading.mesh.materials.size() >= kMax3dsMaterials) return Reading::too_large("materials", kMax3dsMaterials);
    reading.mesh.materials[static_cast<std::size_t>(material_named(reading, name))].color = color;
    return std::nullopt;
}

std::optional<Error> read_faces(Reading& reading, std::string_view content, Object& object) {
    if (content.size() < 2) return reading.bad(content, "a list of faces has no length");
    const std::size_t count = u16(content, 0);
    if (2 + 8 * count > content.size()) return reading.bad(content, "a list of faces is shorter than it says");
    reading.faces += count;
    if (reading.faces > kMax3dsTriangles) return Reading::too_large("triangles", kMax3dsTriangles);
    for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 3; ++k) object.corners.push_back(u16(content, 2 + 8 * i + 2 * k));
    object.materials.assign(count, -1);
    return each_chunk(reading, content.substr(2 + 8 * count),
                      [&](std::uint16_t id, std::string_view inside) -> std::optional<Error> {
                          if (id != kFaceMaterial) return std::nullopt;
                          const auto [name, list] = split_text(inside);
                          if (list.size() < 2) return std::nullopt;
                          const int material = material_named(reading, name);
                          const std::size_t faces = std::min<std::size_t>(u16(list, 0), (list.size() - 2) / 2);
                          for (std::size_t i = 0; i < faces; ++i)
                              if (const std::size_t face = u16(list, 2 + 2 * i); face < count)
                                  object.materials[face] = material;
                          return std::nullopt;
                      });
}

void add_triangles(Reading& reading, const Object& object) {
    Mesh3ds& mesh = reading.mesh;
    for (std::size_t face = 0; face < object.materials.size(); ++face) {
        glm::vec3 corner[3];
        bool exist = true, finite = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t index = object.corners[3 * face + k];
            exist = exist && index < object.points.size();
            if (exist) corner[k] = object.points[index];
            for (int i = 0; exist && i < 3; ++i)
                finite = finite && std::abs(corner[k][i]) <= 1e9f;  // not of NaN either
        }
        if (!exist || !finite) {
            ++(exist ? mesh.left_out.not_finite : mesh.left_out.no_point);
            continue;
        }
        const glm::dvec3 a(corner[0]), b(corner[1]), c(corner[2]);
        if (!(glm::length(glm::cross(b - a, c - a)) > 0.0)) {
            ++mesh.left_out.no_area;
            continue;
        }
        const int material = object.materials[face];
        const auto [at, fresh] = reading.part_of.try_emplace(material, mesh.parts.size());
        if (fresh) mesh.parts.push_back({material, {}});
        for (const glm::vec3& one : corner) {
            mesh.parts[at->second].positions.push_back(one);
            const glm::dvec3 position(one);
            mesh.least = reading.sized ? glm::min(mesh.least, position) : position;
            mesh.most = reading.sized ? glm::max(mesh.most, position) : position;
            reading.sized = true;
        }
    }
}

std::optional<Error> read_triangle_object(Reading& reading, std::string_view content) {
    Object object;
    auto error = each_chunk(reading, content, [&](std::uint16_t id, std::string_view inside) -> std::optional<Error> {
        if (id == kPoints) {
            if (inside.size() < 2) return reading.bad(inside, "a list of points has no length");
            const std::size_t count = u16(inside, 0);
            if (2 + 12 * count > inside.size()) return reading.bad(inside, "a list of points is shorter than it says");
            reading.points += count;
            if (reading.points > kMax3dsVertices) return Reading::too_large("vertices", kMax3dsVertices);
            object.points.resize(count);
            for (std::size_t i = 0; i < count; ++i)
                for (std::size_t k = 0; k < 3; ++k)
                    object.points[i][static_cast<int>(k)] = f32(inside, 2 + 12 * i + 4 * k);
            return std::nullopt;
        }
        if (id == kFaces && object.materials.empty()) return read_faces(reading, inside, object);
        return std::nullopt;
    });
    if (error) return error;
    add_triangles(reading, object);
    return std::nullopt;
}

}  // namespace

Result<Mesh3ds> read_3ds(std::string_view bytes) {
    if (bytes.size() > kMax3dsBytes) return Reading::too_large("bytes", kMax3dsBytes);
    Reading reading{bytes};
    if (bytes.size() < kHeaderBytes || u16(bytes, 0) != kFile) return reading.bad(bytes, "this is no 3DS file");
    // Some exporters write a wrong length for the whole file.
    const std::size_t length = std::clamp<std::size_t>(u32(bytes, 2), kHeaderBytes, bytes.size());
    reading.mesh.bytes_behind = bytes.size() - length;
    using Chunk = std::optional<Error>;
    auto error =
        each_chunk(reading, bytes.substr(kHeaderBytes, length - kHeaderBytes),
                   [&](std::uint16_t id, std::string_view data) -> Chunk {
                       if (id != kMeshData) return std::nullopt;
                       return each_chunk(reading, data, [&](std::uint16_t kind, std::string_view content) -> Chunk {
                           if (kind == kMaterial) return read_material(reading, content);
                           if (kind != kNamedObject) return std::nullopt;
                           return each_chunk(reading, split_text(content).second,
                                             [&](std::uint16_t what, std::string_view object) -> Chunk {
                                                 if (what != kTriangleObject) return std::nullopt;
                                                 return read_triangle_object(reading, object);
                                             });
                       });
                   });
    if (error) return *error;
    return std::move(reading.mesh);
}

glm::dvec3 model_scale(const glm::dvec3& least, const glm::dvec3& most, const glm::dvec3& size_m, double unit_m) {
    glm::dvec3 scale(unit_m);
    for (int i = 0; i < 3; ++i) {
        const double extent = most[i] - least[i];
        if (extent > 1e-9 && size_m[i] > 0.0) scale[i] = size_m[i] / extent;
    }
    return scale;
}

}  // namespace gonio::exchange
