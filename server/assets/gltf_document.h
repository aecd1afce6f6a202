// A glTF file taken apart and checked: the JSON as tinygltf's model, the bytes of its buffers, the sources of its
// images. Buffers and images never pass through tinygltf; no file outside the glTF's own directory is opened.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ies/core/result.h"

namespace tinygltf {
class Model;
}

namespace gonio {

using ByteView = std::span<const std::byte>;

struct GltfSkin {
    std::vector<int> joints;         // nodes
    int inverse_bind_matrices = -1;  // accessor, -1: identity matrices
};

struct GltfDocument {
    struct ImageSource {
        std::string uri;  // empty: the bytes are in buffer_view
        int buffer_view = -1;
    };
    struct IesSource {
        std::string name, uri;  // uri empty: the bytes are in buffer_view
        int buffer_view = -1;
    };
    std::filesystem::path directory;               // empty: no file may be opened
    std::shared_ptr<const tinygltf::Model> model;  // without buffers, images, skins, animations and others' extras
    std::vector<std::vector<std::byte>> buffers;   // as long as their byteLength
    std::vector<ImageSource> images;
    std::vector<IesSource> ies_lights;  // EXT_lights_ies of the root; tinygltf drops empty members of lists
    std::vector<GltfSkin> skins;
    std::map<int, int> visibility_keys;  // node -> accessor of an animation's keys of its KHR_node_visibility
    std::vector<std::string> uris;       // of all these: what the scene is made of beside its own file
    std::vector<std::string> warnings;
};

// path: a .gltf or .glb file, told apart by content. room: bytes of memory that may be taken, of which this takes its
// part. Errors as of load_scene.
Result<GltfDocument> read_gltf_document(const std::string& path, std::size_t& room);
// The same of a file's bytes; its uris may be data: only.
Result<GltfDocument> read_gltf_document(ByteView file, std::size_t& room);

// Result: the bytes of a buffer view whose index has been checked.
ByteView view_bytes(const GltfDocument& document, int buffer_view);

// accessor: an index that has been checked. Result: its elements; components of one, 1 for SCALAR … 16 for MAT4.
std::size_t accessor_count(const GltfDocument& document, int accessor);
std::size_t accessor_components(const GltfDocument& document, int accessor);
// Result: count * components values, converted from any component type; normalised integers become -1..1 or 0..1
// (glTF 2.0, 3.11); sparse substitutions applied.
// Errors: "out_of_bounds" (a sparse index), "bad_gltf" (NaN or infinite, with the place of the element).
Result<std::vector<float>> read_floats(const GltfDocument& document, int accessor);
// The same, with NaN and infinite ones as they are. Errors: "out_of_bounds".
Result<std::vector<float>> read_any_floats(const GltfDocument& document, int accessor);
// Result: the values of a SCALAR accessor of unsigned bytes, shorts or ints. Errors: "bad_gltf", "out_of_bounds".
Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int accessor);

// uri: a relative reference, percent-encoded or not. Result: the file, from the directory. Errors: of read_uri.
Result<std::filesystem::path> file_of_uri(const std::filesystem::path& directory, const std::string& uri,
                                          const std::string& where);
// uri: a data: URI or a relative reference, percent-encoded or not. where: JSON pointer of the uri, for errors.
// Result: at most the first `limit` bytes; a file longer than hard_limit is refused: "too_large".
// Errors: "missing_file", "bad_gltf" (leaves the directory, malformed), "unsupported" (another scheme), "too_large".
Result<std::vector<std::byte>> read_uri(const std::filesystem::path& directory, const std::string& uri,
                                        const std::string& where, std::size_t limit, std::size_t hard_limit);

// Whether the bytes are in the uri itself. Schemes are in capitals or not (RFC 3986, 3.1).
bool is_data_uri(std::string_view uri);

// A short form of a uri for messages.
std::string shown_uri(const std::string& uri);

}  // namespace gonio
