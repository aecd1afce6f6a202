// What the readers of TM-33, GLDF and zip archives promise, whatever the bytes. Shared by fuzz targets and replay test.
#pragma once

#include <string>
#include <string_view>

#include "ies/core/zip.h"
#include "ies/gldf.h"
#include "ies/tm33.h"
#include "ies/writers.h"
#include "tests/fuzz/ies_fuzz_check.h"

namespace gonio::ies::fuzz {

// Any bytes as TM-33; what is read survives being written, to the last bit.
inline void check_tm33(std::string_view bytes) {
    const auto read = read_tm33(bytes);
    check(read);
    check(read_tm33(bytes, {"", "2"}));
    if (!read) return;
    const auto again = read_tm33(write_tm33(*read));
    check(again);
    require(again.ok());
    if (read->web.goniometer == Goniometer::type_c) require(again->web.candela == read->web.candela);
}

// Any bytes as an archive, within limits that let much through.
inline void check_zip(std::string_view bytes) {
    const ZipLimits limits{1u << 20, 100, 4u << 20, 1u << 20, 200, 1u << 16};
    const auto archive = open_zip(std::string(bytes), limits);
    if (!archive) {
        require(!archive.error().code.empty() && !archive.error().where.empty() && !archive.error().message.empty());
        return;
    }
    std::uint64_t total = 0;
    for (const ZipEntry& entry : archive->entries()) {
        require(!entry.name.empty() && ("/" + entry.name + "/").find("/../") == std::string::npos);
        require(entry.name.front() != '/' && entry.name.find("//") == std::string::npos);
        require(archive->find(entry.name) == &entry);
        const auto text = archive->read(entry.name);
        require(text ? text->size() == entry.bytes : !text.error().code.empty() && !text.error().where.empty());
        total += text ? text->size() : 0;
    }
    require(total <= limits.total_bytes);
}

// Any bytes as an archive; and their parts, up to each 0, as the files of one: damage to an archive rarely reaches
// them.
inline void check_gldf(std::string_view bytes) {
    check(read_gldf(bytes));
    check(read_gldf(bytes, {"variant-2", "emitter-1/2"}));
    std::string parts[4];
    std::size_t at = 0;
    for (std::string& part : parts) {
        const std::size_t end = std::min(bytes.find('\0', at), bytes.size());
        part = bytes.substr(std::min(at, bytes.size()), end - std::min(at, end));
        at = end + 1;
    }
    const ZipFile model[] = {{"structure.xml", parts[2]}};
    const ZipFile files[] = {
        {"product.xml", parts[0]}, {"ldc/a.ies", parts[1]}, {"geo/g.l3d", *write_zip(model), false}};
    check(read_gldf(*write_zip(files)));
}

}  // namespace gonio::ies::fuzz
