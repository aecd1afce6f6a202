#include "server/sequence/manifest.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "server/base/atomic_file.h"
#include "server/base/bounded_file.h"
#include "server/base/descriptor.h"
#include "server/base/sha256.h"

namespace gonio::sequence {
namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;

std::string host_name() {
    char name[256] = {};
    if (::gethostname(name, sizeof name - 1) != 0 || name[0] == '\0') return "host";
    for (char* c = name; *c != '\0'; ++c)
        if (*c == '/') *c = '_';
    return name;
}

std::string entry_path(const std::string& folder, const std::string& name) {
    return (fs::path(folder) / kManifestFolder / (name + ".json")).string();
}

std::string text_of(const OrderedJson& json) {
    return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
}

OrderedJson json_of(const Entry& entry) {
    OrderedJson json = {{"name", entry.name}, {"sha256", entry.sha256}, {"bytes", entry.bytes}};
    if (entry.frame >= 0) {
        json["frame"] = entry.frame;
        json["t_s"] = entry.t_s;
        json["scene_rev"] = entry.scene_rev;
    } else {
        json["from"] = entry.from;
    }
    json["job"] = entry.maker.job;
    json["version"] = entry.maker.version;
    json["isa"] = entry.maker.isa;
    json["gl"] = entry.maker.gl;
    json["cpu"] = entry.maker.cpu;
    return json;
}

// Result: nothing where it is no entry.
std::optional<Entry> entry_of(const std::string& text) {
    const OrderedJson json = OrderedJson::parse(text, nullptr, false);
    if (!json.is_object()) return std::nullopt;
    try {
        Entry entry;
        entry.name = json.at("name");
        entry.sha256 = json.at("sha256");
        entry.bytes = json.at("bytes");
        entry.frame = json.value("frame", -1);
        entry.t_s = json.value("t_s", 0.0);
        entry.scene_rev = json.value("scene_rev", 0u);
        entry.from = json.value("from", "");
        entry.maker = {json.at("job"), json.at("version"), json.at("isa"), json.at("gl"), json.at("cpu")};
        return entry;
    } catch (const OrderedJson::exception&) {
        return std::nullopt;
    }
}

// Result: the process of a name that part_name() made on this machine; 0: it is none.
pid_t writer_of(const std::string& file_name) {
    const std::string mark = ".tmp." + host_name() + ".";
    const std::size_t at = file_name.rfind(mark);
    if (!file_name.starts_with(".") || at == std::string::npos) return 0;
    pid_t pid = 0;
    const char *begin = file_name.data() + at + mark.size(), *end = file_name.data() + file_name.size();
    const auto [last, error] = std::from_chars(begin, end, pid);
    return error == std::errc() && last == end ? pid : 0;
}

}  // namespace

std::string part_name(const std::string& path) {
    const fs::path whole(path);
    return (whole.parent_path() /
            ("." + whole.filename().string() + ".tmp." + host_name() + "." + std::to_string(::getpid())))
        .string();
}

Result<bool> write_file(const std::string& folder, const std::string& name, std::string_view bytes) {
    const fs::path path = fs::path(folder) / name;
    std::error_code failed;
    fs::create_directories(path.parent_path(), failed);
    if (failed) return Error{"file_unwritable", "", path.parent_path().string(), failed.message()};
    return write_file_by_way_of(part_name(path.string()), path.string(), bytes);
}

Result<bool> write_entry(const std::string& folder, const Entry& entry) {
    return write_file(folder, std::string(kManifestFolder) + "/" + entry.name + ".json",
                      text_of(json_of(entry)) + "\n");
}

Result<bool> finish_part(const std::string& path) {
    const std::string part = part_name(path);
    const Descriptor file(::open(part.c_str(), O_RDONLY | O_CLOEXEC));
    if (!file || ::fsync(file.fd()) != 0 || std::rename(part.c_str(), path.c_str()) != 0) {
        const int reason = errno;
        ::unlink(part.c_str());
        return Error{"file_unwritable", "", path, std::generic_category().message(reason)};
    }
    sync_folder_of(path);
    return true;
}

void remove_left_parts(const std::string& folder, const std::string& name) {
    const fs::path path(name);
    for (const fs::path& place : {fs::path(folder) / path.parent_path(),
                                  fs::path(folder) / kManifestFolder / path.parent_path(), fs::path(folder)}) {
        std::error_code failed;
        for (fs::directory_iterator at(place, failed), end; !failed && at != end; at.increment(failed)) {
            const pid_t pid = writer_of(at->path().filename().string());
            if (pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH) ::unlink(at->path().c_str());
        }
    }
}

std::optional<Entry> complete_entry(const std::string& folder, const std::string& name, const Maker& maker) {
    const auto text = read_bounded_file(entry_path(folder, name), kMaxEntryBytes);
    if (!text || text->size() > kMaxEntryBytes) return std::nullopt;
    const auto entry = entry_of(*text);
    if (!entry || entry->name != name || entry->maker.job != maker.job || entry->maker.version != maker.version)
        return std::nullopt;
    const FileDigest file = sha256_of_file((fs::path(folder) / name).string());
    if (file.sha256 != entry->sha256 || file.bytes != entry->bytes) return std::nullopt;
    return entry;
}

std::string manifest_text(const std::vector<Entry>& entries) {
    std::string text = "[\n";
    for (const Entry& entry : entries) text += text_of(json_of(entry)) + (&entry == &entries.back() ? "\n" : ",\n");
    return text + "]\n";
}

std::string cpu_name() {
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);)
        if (line.starts_with("model name")) {
            const std::size_t at = line.find(": ");
            return at == std::string::npos ? "" : line.substr(at + 2);
        }
    return "";
}

}  // namespace gonio::sequence
