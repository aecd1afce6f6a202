#include "server/assets/gltf_document.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "protocol/text/shortened_text.h"
#include "server/assets/assets.h"
#include "server/assets/glb_chunks.h"
#include "server/assets/gltf_check.h"
#include "server/assets/gltf_expand.h"
#include "server/assets/gltf_features.h"
#include "server/assets/gltf_import.h"
#include "server/assets/gltf_mend.h"
#include "server/assets/gltf_rest.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// There is such a file, but no descriptor is left, or the disk fails.
Error unreadable(const std::string& path, int reason) {
    return {"file_unreadable", path, "", std::string("the scene file cannot be read: ") + std::strerror(reason)};
}

struct Container {
    std::string_view json;
    std::optional<ByteView> binary;  // BIN chunk of a .glb, may be empty
};

std::uint32_t little_endian(ByteView bytes, std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
    return value;
}

std::string_view as_text(ByteView bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Where the chunk after the one that ends here starts: there, or where a writer has padded without counting it.
std::size_t next_chunk(ByteView file, std::size_t end, std::size_t length) {
    const std::size_t padded = (end + 3) / 4 * 4;
    const auto is_binary = [&](std::size_t at) {
        return at + 8 <= length && little_endian(file, at + 4) == kBinaryChunk &&
               little_endian(file, at) <= length - at - 8;
    };
    return is_binary(padded) && !is_binary(end) ? padded : end;
}

// glTF 2.0, 4.4 "Binary glTF Layout". Anything that does not start with "glTF" is taken for JSON.
Result<Container> open_container(ByteView file) {
    if (file.size() < 4 || as_text(file.first(4)) != "glTF") return Container{as_text(file), std::nullopt};
    const auto bad = [](std::size_t at, std::uint64_t value, std::string message) {
        return Error{"bad_gltf", "byte " + std::to_string(at), std::to_string(value), std::move(message)};
    };
    if (file.size() < 20) return bad(4, file.size(), "the binary glTF ends within its header");
    if (little_endian(file, 4) != 2) {
        return Error{"unsupported", "byte 4", std::to_string(little_endian(file, 4)), "only binary glTF 2 is read"};
    }
    const std::size_t said = little_endian(file, 8);
    if (said > file.size() || said < 20) return bad(8, said, "the binary glTF is truncated");
    const std::size_t length = std::min(file.size(), (said + 3) / 4 * 4);  // some writers do not count the padding
    Container container;
    std::size_t at = 12;
    for (int chunk = 0; at + 8 <= length; ++chunk) {
        const std::size_t size = little_endian(file, at);
        const std::uint32_t type = little_endian(file, at + 4);
        if (size > length - at - 8) return bad(at, size, "a chunk reaches beyond the end of the file");
        const ByteView content = file.subspan(at + 8, size);
        if (chunk == 0 && type != kJsonChunk) return bad(at + 4, type, "the first chunk of a binary glTF is JSON");
        if (chunk == 0) container.json = as_text(content);
        if (chunk == 1 && type == kBinaryChunk) container.binary = content;
        at = next_chunk(file, at + 8 + size, length);
    }
    return container;
}

// Of extras the level of a light is kept, as Gonio writes it.
void prune_extras(Json& value) {
    const auto extras = value.find("extras");
    if (extras == value.end()) return;
    const Json own = extras->is_object() ? extras->value("gonio", Json()) : Json();
    const auto number = [&](const char* name) { return own.is_object() ? own.value(name, Json()) : Json(); };
    const Json level = number("level_ratio"), multiplier = number("multiplier");
    if (level.is_number() && multiplier.is_number())
        *extras = {{"gonio", {{"level_ratio", level}, {"multiplier", multiplier}}}};
    else
        value.erase(extras);
}

// tinygltf copies extras and extensions into trees of its own: keep only what the importer reads.
void prune(Json& value) {
    if (value.is_object()) {
        prune_extras(value);
        const auto extensions = value.find("extensions");
        if (extensions != value.end() && extensions->is_object()) {
            for (auto it = extensions->begin(); it != extensions->end();) {
                const GltfFeature* const known = find_extension(it.key());
                const bool read = known && known->state <= FeatureState::approximated;
                it = read ? std::next(it) : extensions->erase(it);
            }
        }
    }
    if (value.is_structured()) {
        for (Json& child : value) prune(child);
    }
}

Result<std::shared_ptr<const tinygltf::Model>> build_model(Json document) {
    for (const char* unread : {"buffers", "images", "skins", "animations"}) document.erase(unread);
    complete_spots(document);
    prune(document);
    const std::string text = document.dump();
    auto model = std::make_shared<tinygltf::Model>();
    tinygltf::TinyGLTF reader;
    // No file is ever opened by the reader.
    reader.SetFsCallbacks(
        {[](const std::string&, void*) { return false; }, [](const std::string&, void*) { return std::string(); },
         [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; },
         [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }, nullptr});
    std::string error, warning;
    bool good = false;
    try {
        good = reader.LoadASCIIFromString(model.get(), &error, &warning, text.data(),
                                          static_cast<unsigned int>(text.size()), "", tinygltf::NO_REQUIRE);
    } catch (const std::exception& thrown) {
        error = thrown.what();
    }
    if (good) return std::shared_ptr<const tinygltf::Model>(std::move(model));
    while (!error.empty() && error.back() == '\n') error.pop_back();
    return Error{"bad_gltf", "", error.substr(0, 200), "the glTF document is malformed"};
}

Result<std::vector<std::vector<std::byte>>> read_buffers(const Json& document, const fs::path& directory,
                                                         const std::optional<ByteView>& binary, std::size_t& room) {
    std::vector<std::vector<std::byte>> buffers;
    const Json buffer_list = document.value("buffers", Json::array());
    for (std::size_t i = 0; i < buffer_list.size(); ++i) {
        const std::string where = "/buffers/" + std::to_string(i);
        const auto length = buffer_list[i]["byteLength"].get<std::size_t>();
        std::vector<std::byte> bytes;
        const bool has_bytes = buffer_list[i].contains("uri") || (i == 0 && binary.has_value());
        if (!has_bytes || is_meshopt_fallback(buffer_list[i])) {
            buffers.emplace_back();  // nothing reads it: check_gltf()
            continue;
        }
        if (buffer_list[i].contains("uri")) {
            if (auto full = take_memory(room, length, kBytesOfByte, where + "/byteLength")) return *full;
            auto read = read_uri(directory, buffer_list[i]["uri"].get<std::string>(), where + "/uri", length,
                                 kMaxSceneFileBytes);
            if (!read) return read.error();
            bytes = std::move(*read);
        } else {
            const ByteView used = binary->first(std::min(length, binary->size()));
            bytes.assign(used.begin(), used.end());
        }
        if (bytes.size() < length) {
            return Error{"out_of_bounds", where + "/byteLength", std::to_string(length),
                         "the buffer holds only " + std::to_string(bytes.size()) + " bytes"};
        }
        buffers.push_back(std::move(bytes));
    }
    return buffers;
}

// Those that say where they are used what was made of them, when they are.
constexpr std::array kSaidWhereUsed = {"KHR_materials_transmission", "KHR_materials_unlit", "KHR_texture_basisu",
                                       "EXT_texture_avif", "MSFT_texture_dds"};

void note_unread(const Json& document, std::vector<std::string>& warnings) {
    std::set<std::string> used;
    for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
        for (const Json& name : document.value(list, Json::array())) used.insert(name.get<std::string>());
    }
    for (const std::string& extension : used) {
        const GltfFeature* const known = find_extension(extension);
        if (!known)
            warnings.push_back("the extension " + shortened_text(extension, 80) +
                               " is not known and was ignored; perhaps it changes lux");
        else if (known->state != FeatureState::supported && std::ranges::count(kSaidWhereUsed, extension) == 0)
            warnings.push_back(feature_warning(*known));
    }
    const auto has = [&](const char* list) { return document.contains(list) && !document[list].empty(); };
    if (has("animations")) warnings.push_back(feature_warning("animations"));
}

}  // namespace

// result: with its directory. The memory of `file` has been taken.
static Result<GltfDocument> read_gltf_document(ByteView file, GltfDocument result, std::size_t& room);

Result<GltfDocument> read_gltf_document(const std::string& path, std::size_t& room) {
    std::error_code failed;
    if (!fs::exists(path, failed)) return Error{"not_found", path, "", "there is no such scene file"};
    if (!fs::is_regular_file(path, failed)) return Error{"not_found", path, "", "this is not a regular file"};
    GltfDocument result;
    result.directory = fs::absolute(path, failed).parent_path();
    std::ifstream stream(path, std::ios::binary);
    if (!stream) return unreadable(path, errno);
    const std::uintmax_t size = fs::file_size(path, failed);
    if (failed) return unreadable(path, failed.value());
    if (size > kMaxSceneFileBytes) return Error{"too_large", path, std::to_string(size), "the scene file is too large"};
    if (auto full = take_memory(room, size, kBytesOfByte, path)) return *full;
    std::vector<std::byte> file(size);
    stream.read(reinterpret_cast<char*>(file.data()), static_cast<std::streamsize>(size));
    if (static_cast<std::uintmax_t>(stream.gcount()) != size) return unreadable(path, errno);
    return read_gltf_document(file, std::move(result), room);
}

Result<GltfDocument> read_gltf_document(ByteView file, std::size_t& room) {
    if (auto full = take_memory(room, file.size(), kBytesOfByte, "")) return *full;
    return read_gltf_document(file, GltfDocument(), room);
}

static Result<GltfDocument> read_gltf_document(ByteView file, GltfDocument result, std::size_t& room) {
    auto container = open_container(file);
    if (!container) return container.error();
    if (auto error = check_json_size(container->json)) return *error;
    Json document;
    try {
        document = Json::parse(container->json);
    } catch (const Json::parse_error& error) {
        return Error{"bad_gltf", "byte " + std::to_string(error.byte), "", "the JSON is malformed"};
    } catch (const Json::exception& error) {  // a number beyond double
        return Error{"bad_gltf", "", std::string(error.what()).substr(0, 120), "the JSON is malformed"};
    }
    mend_gltf(document, result.warnings);
    if (auto error = check_gltf(document, container->binary.has_value())) return *error;

    auto buffers = read_buffers(document, result.directory, container->binary, room);
    if (!buffers) return buffers.error();
    result.buffers = std::move(*buffers);
    GltfExpansion expansion{document, result.buffers, room, result.warnings};
    for (const auto step : {expand_meshopt, expand_draco}) {
        if (auto error = step(expansion)) return *error;
    }
    for (const Json& image : document.value("images", Json::array())) {
        result.images.push_back({image.value("uri", ""), image.value("bufferView", -1)});
    }
    static const Json::json_pointer ies_lights("/extensions/EXT_lights_ies/lights");
    for (const Json& light : document.value(ies_lights, Json::array())) {
        result.ies_lights.push_back({light.value("name", ""), light.value("uri", ""), light.value("bufferView", -1)});
    }
    result.skins = skins_of(document);
    result.visibility_keys = visibility_keys_of(document);
    for (const Json& buffer : document.value("buffers", Json::array())) result.uris.push_back(buffer.value("uri", ""));
    for (const auto& image : result.images) result.uris.push_back(image.uri);
    for (const auto& light : result.ies_lights) result.uris.push_back(light.uri);
    std::erase_if(result.uris, [](const std::string& uri) { return uri.empty() || is_data_uri(uri); });
    note_unread(document, result.warnings);
    auto model = build_model(std::move(document));
    if (!model) return model.error();
    result.model = std::move(*model);
    return result;
}

ByteView view_bytes(const GltfDocument& document, int buffer_view) {
    const tinygltf::BufferView& view = document.model->bufferViews[buffer_view];
    return ByteView(document.buffers[view.buffer]).subspan(view.byteOffset, view.byteLength);
}

}  // namespace gonio
