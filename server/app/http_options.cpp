#include "server/app/http_options.h"

#include <sys/stat.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "ies/core/number_text.h"
#include "protocol/schema/codec.h"
#include "server/app/option_checks.h"
#include "server/base/bounded_file.h"
#include "server/http/tls.h"

namespace gonio {
namespace {

constexpr std::size_t kMinTokenBytes = 16;    // 128 bits where every byte is a random one; a hexadecimal one has 32
constexpr std::size_t kMaxTokenBytes = 4096;  // of its line
constexpr const char* kBlanks = " \t\r";      // beside a token, which editors and copying leave

std::string seconds_text(std::chrono::milliseconds time) {
    return number_text(static_cast<double>(time.count()) * 1e-3);
}

void add_seconds(CLI::App& app, const char* name, std::chrono::milliseconds& value, const char* what) {
    app.add_option_function<double>(
           name, [&value](double s) { value = std::chrono::milliseconds(std::lround(s * 1000)); }, what)
        ->check(finite_in(0.01, 86'400))
        ->default_str(seconds_text(value));
}

// What CLI11 is told of an option: seven parameters.
template <typename Bytes>
void add_size(CLI::App& app, const char* name, Bytes& value, Bytes unit, std::uint64_t most, const char* what,
              std::uint64_t least = 1) {
    app.add_option_function<std::uint64_t>(
           name, [&value, unit](std::uint64_t count) { value = static_cast<Bytes>(count) * unit; }, what)
        ->check(CLI::Range(least, most))
        ->default_str(std::to_string(value / unit));
}

void add_count(CLI::App& app, const char* name, unsigned& value, unsigned least, const char* what) {
    app.add_option(name, value, what)->check(CLI::Range(least, 1'000'000u));
}

}  // namespace

// One list of options.
void add_front_options(CLI::App& app, Options& options) {
    HttpLimits& limits = options.limits;
    app.add_option("--tls-cert", options.tls_certificate, "PEM file: the certificate chain; with --tls-key: https");
    app.add_option("--tls-key", options.tls_key, "PEM file: the key of --tls-cert; both are read again on SIGHUP");
    app.add_option("--host-name", options.host_names,
                   "a name that requests may have in Host, beside localhost and addresses; may be given more than once")
        ->allow_extra_args(false)  // else CLI11 takes "[::1]" for a list
        ->check(check_host_name);
    app.add_option("--allow-origin", options.origins,
                   "scheme://host:port of pages elsewhere that may use this server; may be given more than once")
        ->check(check_origin);
    app.add_option("--upload-dir", options.upload_folder,
                   "folder for uploaded files, kept; default: a private one, removed at the end")
        ->check(check_upload_folder);
    app.add_option("--scene-root", options.scene_roots,
                   "folder below which clients may load scene files; may be given more than once. Default: everywhere "
                   "while --listen is a loopback address, else nowhere")
        ->allow_extra_args(false);
    app.add_option(
           "--library", options.library_folders,
           "folder of photometric files (.ies, .ldt, .xml, .iesxml, .gldf, .zip), and those below it, that lights "
           "can have by name; may be "
           "given more than once")
        ->allow_extra_args(false)
        ->check(CLI::ExistingDirectory);
    app.add_option("--log", options.log, "how the log is written to standard error: text, or json: an object a line")
        ->check(CLI::IsMember({"text", "json"}));
    app.add_option("--log-level", options.log_level, "trace, debug, info, warn, error or off; read again on SIGHUP")
        ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));

    add_count(app, "--max-clients", limits.clients, 1, "viewers and other clients; one more is answered 503");
    add_count(app, "--max-clients-per-address", limits.clients_per_address, 0,
              "of one address that is not loopback; one more is answered 429; 0: no limit");
    add_count(app, "--max-local-clients", limits.local_clients, 0, "the same for loopback addresses");
    add_count(app, "--max-connections", limits.connections, 1, "of any kind; one more is closed");
    add_count(app, "--max-connections-per-address", limits.connections_per_address, 0, "likewise; 0: no limit");
    add_count(app, "--max-local-connections", limits.local_connections, 0, "likewise, for loopback addresses");
    add_seconds(app, "--header-timeout", limits.header, "s for a whole request header (and for the TLS handshake)");
    add_size<std::size_t>(app, "--max-header-kib", limits.header_bytes, 1 << 10, 1024,
                          "KiB of a request header; then 431");
    add_seconds(app, "--identify-timeout", limits.identify, "s for Identify; then the socket is closed with 4002");
    add_size<std::size_t>(app, "--max-identify-kib", limits.identify_bytes, 1 << 10, 1024,
                          "KiB of Identify; more is closed with 1009");
    add_seconds(app, "--ping-interval", limits.ping, "s of silence after which a client is pinged");
    add_seconds(app, "--dead-timeout", limits.dead, "s of silence after which a client is dropped");
    add_seconds(app, "--write-timeout", limits.write_stall, "s in which a client takes no byte; then it is dropped");
    add_count(app, "--max-auth-failures", limits.auth_failures, 1,
              "wrong tokens a minute from one address; then 429 for the rest of the minute");
    add_size<std::size_t>(app, "--max-message-kib", limits.message_bytes, 1 << 10, kMaxMessageBytes >> 10,
                          "KiB of a message to the server; more is closed with 1009");
    add_size<std::size_t>(app, "--max-queued-messages", limits.queued_messages, 1, 1'000'000,
                          "messages that wait for a slow client; then it is told the state anew, or closed with 4009",
                          4);
    add_size<std::size_t>(app, "--max-queued-mib", limits.queued_bytes, 1 << 20, 1 << 16,
                          "MiB that wait for a slow client; an answer for which there is no room becomes busy");
    add_size<std::size_t>(app, "--max-transport-mib", options.transport_bytes, 1 << 20, 4096,
                          "MiB for how surfaces exchange light; less: coarser indirect light", 16);
    add_size<std::size_t>(app, "--max-layers-mib", options.layer_bytes, 1 << 20, 65536,
                          "MiB for luminaires' own light in the live picture; beyond, they are summed", 16);
    add_size<std::size_t>(
        app, "--max-memory-mib", options.max_memory, 1 << 20, 1 << 22,
        "MiB of the process, beyond which no scene is loaded; 0: what the machine and its cgroup have", 0);
    app.add_option("--max-albedo", options.load.max_albedo, "reflectance of scene files; what exceeds it is bounded")
        ->check(finite_in(0.0, 0.99));
    add_count(app, "--max-outstanding", limits.outstanding, 1, "unanswered requests of a client; one more is busy");
    app.add_option("--max-updates", limits.updates_per_s, "commands of a client a second; more are told slow_down")
        ->check(finite_in(0.1, 1e6));
    app.add_option("--max-update-burst", limits.update_burst, "commands that a client may send at once")
        ->check(finite_in(1, 1e6));
    app.add_option("--max-side", limits.side_px, "pixels of a picture's or capture's side that clients may ask for")
        ->check(CLI::Range(16, 4096));
    add_seconds(app, "--key-interval", limits.key_interval, "s at least between two key frames that one client causes");
    add_seconds(app, "--still-timeout", limits.still, "s for a still; then 504");
    add_count(app, "--max-captures", options.max_captures, 1, "captures that wait for each other; one more is busy");
    add_size<std::uint64_t>(app, "--max-upload-mib", limits.upload_bytes, 1 << 20, 1 << 20,
                            "MiB of one uploaded file; more is answered 413; 0: no uploads", 0);
    add_size<std::uint64_t>(app, "--max-uploads-mib", limits.upload_total_bytes, 1 << 20, 1 << 24,
                            "MiB of all uploaded files; more is answered 507");
    add_count(app, "--max-uploads", limits.upload_files, 1, "uploaded files; one more is answered 507");
}

bool is_loopback(const std::string& host) {
    return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0;
}

Result<std::string> token_of_file(const std::string& path, std::string* warning, const char* option) {
    if (path.empty()) return std::string();
    const auto refused = [&](const std::string& message) { return Error{"file_unreadable", option, path, message}; };
    const auto text = read_bounded_file(path, kMaxTokenBytes);
    if (!text) return refused(text.error().message);
    const std::string line = text->substr(0, text->find('\n'));
    if (line.size() > kMaxTokenBytes)
        return refused("its first line must be no longer than " + std::to_string(kMaxTokenBytes) + " bytes");
    const std::size_t begin = std::min(line.find_first_not_of(kBlanks), line.size());
    const std::size_t end = line.find_last_not_of(kBlanks) + 1;  // npos + 1 is 0
    for (std::size_t i = begin; i < end; ++i)
        if (line[i] < 0x21 || line[i] > 0x7E)
            return refused("byte " + std::to_string(i + 1) +
                           " of its first line is none that HTTP carries in a token: 0x21..0x7E");
    const std::string token = line.substr(begin, std::max(begin, end) - begin);
    if (token.size() < kMinTokenBytes) return refused("must hold a token of at least 16 bytes in its first line");
    struct stat status {};
    if (warning != nullptr && ::stat(path.c_str(), &status) == 0 && (status.st_mode & (S_IROTH | S_IWOTH)) != 0)
        *warning = "the token file '" + path + "' can be read by every user of this machine";
    return token;
}

Result<Tokens> read_tokens(const Options& options, std::string* warnings) {
    std::string of_all, of_viewers;
    const auto all = token_of_file(options.token_file, &of_all);
    if (!all) return all.error();
    const auto viewers = token_of_file(options.viewer_token_file, &of_viewers, "--viewer-token-file");
    if (!viewers) return viewers.error();
    const auto refused = [&](const char* message) {
        return Error{"invalid_argument", "--viewer-token-file", options.viewer_token_file, message};
    };
    if (all->empty() && !viewers->empty())
        return refused("needs --token-file too: without it everybody may change all");
    if (!viewers->empty() && *all == *viewers) return refused("must hold another token than --token-file");
    if (warnings != nullptr) *warnings = of_all + (of_all.empty() || of_viewers.empty() ? "" : "; ") + of_viewers;
    return Tokens{*all, *viewers};
}

std::vector<OptionFault> check_front_options(const Options& options) {
    std::vector<OptionFault> faults;
    if (!is_loopback(options.host) && options.token_file.empty())
        faults.push_back(
            {{"listen"},
             "listening on " + options.host + " needs --token-file: only loopback addresses may go without"});
    if (const auto tokens = read_tokens(options); !tokens)
        faults.push_back({{tokens.error().where.substr(2)}, tokens.error().text()});  // it names the option
    if (options.tls_certificate.empty() != options.tls_key.empty()) {
        faults.push_back({{"tls-cert", "tls-key"},
                          std::string("--tls-cert and --tls-key belong together: --tls-") +
                              (options.tls_key.empty() ? "key" : "cert") + " is missing"});
    } else if (!options.tls_certificate.empty()) {
        if (const auto tls = load_tls(options.tls_certificate, options.tls_key); !tls)
            faults.push_back({{tls.error().where == options.tls_key ? "tls-key" : "tls-cert"}, tls.error().text()});
    }
    for (const std::string& root : options.scene_roots) {
        std::error_code failed;
        if (!std::filesystem::is_directory(root, failed))
            faults.push_back({{"scene-root"}, "--scene-root " + root + " is no folder"});
    }
    const HttpLimits& limits = options.limits;
    if (limits.dead <= limits.ping)
        faults.push_back({{"dead-timeout", "ping-interval"},
                          "--dead-timeout must be longer than --ping-interval: " + seconds_text(limits.dead) +
                              " s is not longer than " + seconds_text(limits.ping) + " s"});
    return faults;
}

}  // namespace gonio
