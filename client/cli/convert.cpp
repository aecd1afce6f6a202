#include "client/cli/convert.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/cli/cli.h"
#include "client/cli/photometry.h"
#include "ies/photometry_file.h"
#include "ies/writers.h"
#include "protocol/schema/upload_name.h"

namespace gonio {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Format {
    const char* ending;
    const char* name;
    std::string (*write)(const ies::Photometry&);
};
constexpr Format kFormats[] = {{".ies", "LM-63-2019", ies::write_lm63},
                               {".ldt", "EULUMDAT", ies::write_eulumdat},
                               {".xml", "TM-33-22", ies::write_tm33}};

constexpr double kSameFlux = 1e-3;  // relative: grids are resampled where a format has no other way

const Format* format_of(const std::string& file) {
    for (const Format& format : kFormats)
        if (ending_of(file) == format.ending) return &format;
    return nullptr;
}

bool is_same_file(const std::string& a, const std::string& b) {
    std::error_code failed;
    return a == b || fs::equivalent(a, b, failed);
}

// Writes beside the file and gives it its name when all is on the disk.
bool write_file(const std::string& file, const std::string& bytes) {
    const std::string part = file + ".part-" + std::to_string(::getpid());
    std::ofstream stream(part, std::ios::binary | std::ios::trunc);
    stream << bytes;
    stream.close();
    std::error_code failed;
    if (stream.good()) fs::rename(part, file, failed);
    if (stream.good() && !failed) return true;
    fs::remove(part, failed);
    return false;
}

}  // namespace

int convert(const Session& session, const ReadWords& words) {
    const std::string& in = words.names.at(0);
    const std::string& out = words.names.at(1);
    const auto option = [&](const char* name) { return words.has(name) ? words.options.at(name) : std::string(); };
    const Format* format = format_of(out);
    if (!format) return session.fail({"invalid_argument", "OUT", out, "must end in .ies, .ldt or .xml (TM-33)"});
    if (is_same_file(in, out)) return session.fail({"same_file", "OUT", out, "the input is not written over"});
    const auto read = read_photometric_file(in, {option("--variant"), option("--emitter")});
    if (!read) {
        Error error = read.error();
        if (error.where != in) error.where = in + ": " + error.where;
        return session.fail(error);
    }
    const std::string bytes = format->write(*read);
    const auto again = ies::read_photometry(bytes);
    if (!again)
        return session.fail({"unsupported", "OUT", out, "the format cannot hold this web: " + again.error().text()});
    if (!write_file(out, bytes)) return session.fail({"file_unwritable", "OUT", out, "the file cannot be written"});

    const double before = total_flux(read->web).in(lm);
    const double after = total_flux(again->web).in(lm);
    const bool changed = std::abs(after - before) > kSameFlux * before;
    if (session.json) {
        Json diagnostics = Json::array();
        for (const ies::Diagnostic& d : read->diagnostics)
            diagnostics.push_back({{"code", d.code},
                                   {"severity", d.severity},
                                   {"line", d.line},
                                   {"column", d.column},
                                   {"message", d.message}});
        const Json line = {{"file", in},
                           {"out", out},
                           {"from", read->provenance.format},
                           {"to", format->name},
                           {"flux_lm", before},
                           {"flux_written_lm", after},
                           {"diagnostics", diagnostics}};
        session.out << line.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
        return kExitOk;
    }
    for (const ies::Diagnostic& d : read->diagnostics)
        session.err << d.severity << ": " << d.code << ", line " << d.line << ": " << d.message << '\n';
    if (changed)
        session.err << "warning: the flux became " << after << " lm: " << format->name
                    << " cannot hold the grid as it is\n";
    session.out << out << ": " << format->name << " from " << read->provenance.format << ", " << before << " lm\n";
    return kExitOk;
}

}  // namespace gonio
