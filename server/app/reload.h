// What SIGHUP does: certificate, token files and log level are read again, file and environment with them.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/app/options.h"
#include "server/http/http_server.h"

namespace gonio {

// What was read again. Whatever cannot be used is missing here, and stays as it was.
struct Reread {
    std::optional<std::string> log_level;
    std::optional<Tokens> tokens;
    std::shared_ptr<TlsContext> tls;  // also null where there is no TLS
    struct Kept {
        std::string what, why;  // "the tokens" and a sentence
    };
    std::vector<Kept> kept;
    std::string warning;
};

// Reads the files and changes nothing; it takes as long as the disk. Any thread.
Reread read_again(const Options& options);
// Makes the HTTP server and the log use it, and logs what stays. Any thread; it does not wait.
void use_again(const Reread& reread, HttpServer& http_server);

// Reads on a thread of its own, one after the other, because a disk may hang: nobody waits for it, the end neither. All
// functions: any thread.
class Reloading {
public:
    // read: keeps what it needs; it may run longer than this lives.
    explicit Reloading(std::function<Reread()> read);
    ~Reloading();
    Reloading(const Reloading&) = delete;
    Reloading& operator=(const Reloading&) = delete;

    // Once more, however often this is called while one waits: for begin(), or for the one that reads.
    void ask();
    // From now on what is read is given to `use`, by the reading thread.
    void begin(std::function<void(const Reread&)> use);
    // Nothing is given to anybody any more when this returns.
    void end();

private:
    struct Shared;
    static void start(const std::shared_ptr<Shared>& shared);
    static void work(const std::shared_ptr<Shared>& shared);

    std::shared_ptr<Shared> shared_;
};

}  // namespace gonio
