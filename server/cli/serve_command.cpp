#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/remote/remote_options.h"
#include "common/remote/remote_url.h"
#include "server/cli/commands.h"
#include "server/scratch/scratch_memory.h"
#include "server/serve/http_routes.h"
#include "server/serve/serve.h"

namespace intervale {
namespace {

constexpr const char* kScratchFolder = "/var/tmp";  // which is on a disk, unlike /tmp on many systems

struct ServeCommand {
  ServeOptions serve;
  std::optional<std::uint64_t> data_memory;
  std::optional<std::string> scratch;
  LogOptions log;
  TlsFiles tls;
  std::vector<std::string> inputs;
  RemoteOptions remote;
  std::chrono::milliseconds remote_poll_time = RemoteInputs().poll_time;
};

// The parser ignores empty variables. One that was meant to protect the server must not leave it open.
bool is_empty_in_environment(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr && *value == '\0';
}

// nullptr: data sets lie in the process' own memory.
Result<std::unique_ptr<ScratchMemory>> open_data_memory(const ServeCommand& options) {
  if (!options.data_memory) {
    if (options.scratch) return misuse("--scratch belongs to a limit of the data sets' memory: give --data-memory too");
    return nullptr;
  }
  if (options.serve.max_memory && *options.serve.max_memory <= *options.data_memory)
    return misuse("--max-memory must be more than --data-memory, which it includes");
  auto memory = ScratchMemory::open_for_data_sets(options.scratch.value_or(kScratchFolder), *options.data_memory);
  if (!memory) return tl::unexpected(Error{"--data-memory: " + memory.error().message, memory.error().usage});
  ScratchMemory::install(**memory);
  return memory;
}

Result<void> run(const ServeCommand& options) {
  for (const auto& [name, given] :
       {std::pair("INTERVALE_TOKENS", options.serve.tokens.has_value()), std::pair("INTERVALE_TLS_CERT", options.serve.tls.has_value()),
        std::pair("INTERVALE_TLS_KEY", options.serve.tls.has_value())}) {
    if (!given && is_empty_in_environment(name)) return misuse(std::string(name) + " is set but empty: set it to a file, or unset it");
  }
  if (options.serve.on_demand && options.serve.max_memory && !options.data_memory)
    return misuse("--on-demand with --max-memory needs --data-memory: files are read whole where memory is limited");
  std::vector<std::filesystem::path> paths;
  RemoteInputs remote;
  for (const std::string& input : options.inputs) {
    if (!is_remote_url(input)) {
      paths.emplace_back(input);
      continue;
    }
    auto url = parse_remote_url(input);
    if (!url) return tl::unexpected(url.error());
    remote.urls.push_back(std::move(*url));
  }
  auto access = read_access(options.remote);
  if (!access) return tl::unexpected(access.error());
  const bool has_credentials = !access->headers.empty() || access->aws;
  for (const RemoteUrl& url : remote.urls) {
    if (has_credentials && url.origin != remote.urls.front().origin) return misuse("--header-file and --aws-sign are for the files of one host");
  }
  remote.access = std::move(*access);
  remote.poll_time = options.remote_poll_time;
  const auto data_memory = open_data_memory(options);
  if (!data_memory) return tl::unexpected(data_memory.error());
  ServeOptions serve_options = options.serve;
  serve_options.data_memory = data_memory->get();
  return serve(serve_options, options.log, paths, std::move(remote));
}

// The log level in a configuration file; nullopt if it has none, or cannot be read.
std::optional<std::string> configured_level(const std::string& file) {
  try {
    for (const CLI::ConfigItem& item : CLI::ConfigTOML().from_file(file)) {
      if (item.parents == std::vector<std::string>{"serve"} && item.name == "log-level" && item.inputs.size() == 1) return item.inputs.front();
    }
  } catch (const CLI::Error& error) {
    spdlog::warn("cannot reread {}: {}", file, error.what());
  }
  return {};
}

void add_log_options(CLI::App& command, LogOptions& log) {
  const auto group = "Logs and metrics";
  command
      .add_option_function<std::string>(
          "--log-format", [&log](const std::string& format) { log.format = format == "json" ? LogFormat::json : LogFormat::text; },
          "Format of the log on stderr: text (default), or one JSON object per line")
      ->check([](const std::string& format) { return std::string(format == "text" || format == "json" ? "" : "must be text or json"); })
      ->type_name("text|json")
      ->group(group);
  command.add_option("--log-level", log.level, "Least severity logged: trace, debug, info, warn, error, off; SIGHUP rereads it from --config")
      ->check([](const std::string& level) { return std::string(is_log_level(level) ? "" : "must be trace, debug, info, warn, error or off"); })
      ->type_name("LEVEL")
      ->capture_default_str()
      ->group(group);
  log.configured_level = [&command]() -> std::optional<std::string> {
    const CLI::Option* const config = command.get_parent()->get_config_ptr();
    if (config == nullptr || config->count() == 0) return {};
    return configured_level(config->as<std::string>());
  };
}

// An origin has no path: one with a path would never match.
bool may_be_origin(const std::string& text) {
  const std::size_t scheme = text.find("://");
  return text == "*" ||
         (scheme != 0 && scheme != std::string::npos && scheme + 3 < text.size() && text.find_first_of("/ \t?#@", scheme + 3) == std::string::npos);
}

std::string check_at_least_one(const std::string& text) {
  double value = 0;
  return CLI::detail::lexical_cast(text, value) && value >= 1 && value <= 1e15 ? "" : "must be 1 or more";
}

CLI::Option* add_milliseconds(CLI::App& command, const std::string& name, std::chrono::milliseconds& time, double least,
                              const std::string& description) {
  return command
      .add_option_function<double>(
          name,
          [&time, name](double seconds) {
            // NaN passes every range check.
            if (std::isnan(seconds)) throw CLI::ValidationError(name, "must be a number");
            time = std::chrono::milliseconds(std::llround(1000 * seconds));
          },
          description)
      ->check(CLI::Range(least, 86400.0))
      ->type_name("SECONDS")
      ->group("Limits");
}

template <class Limit>
CLI::Option* add_limit(CLI::App& command, const std::string& name, Limit& limit, const std::string& description) {
  return command.add_option(name, limit, description)->check(check_at_least_one)->group("Limits");
}

void add_limits(CLI::App& command, ServeCommand& options) {
  ServeOptions& serve = options.serve;
  add_limit(command, "--max-connections", serve.max_connections, "Connections at a time; further ones take the place of silent ones, or are closed")
      ->capture_default_str();
  add_limit(command, "--max-connections-per-address", serve.max_connections_per_address,
            "Connections of one address (IPv6: of one /64) at a time. Behind a proxy it needs --trusted-proxy. "
            "Default: no limit")
      ->type_name("N");
  add_limit(command, "--max-sessions", serve.max_sessions, "Sessions at a time; further ones are answered 503. Default: no limit")->type_name("N");
  const auto bytes = CLI::AsSizeValue(true);
  add_limit(command, "--max-memory", serve.max_memory,
            "Memory of data sets, sessions, unsent messages and ranges above which new sessions are answered 503, such as 2GiB or 500MB. "
            "Default: no limit")
      ->transform(bytes)
      ->type_name("BYTES");
  add_limit(command, "--data-memory", options.data_memory,
            "Most resident memory of data sets, such as 2GiB or 500MB; they lie in a scratch file, and may be larger. Default: no limit, and no file")
      ->transform(bytes)
      ->type_name("BYTES");
  command.add_option("--scratch", options.scratch, std::string("Folder of the scratch file, on a disk. Default: ") + kScratchFolder)
      ->type_name("FOLDER")
      ->group("Limits");
  add_limit(command, "--max-queued-bytes", serve.max_queued_bytes,
            "Unsent bytes of all sessions; above, the slowest readers are disconnected, if their message has been waiting for more "
            "than 1 s. Default: 512MiB")
      ->transform(bytes)
      ->type_name("BYTES");
  add_limit(command, "--max-messages-per-second", serve.messages_per_second,
            "Messages of each session; a session that sends more is read more slowly")
      ->capture_default_str();
  add_limit(command, "--max-views-per-second", serve.views_per_second, "Views of each session; a session that sends more is read more slowly")
      ->capture_default_str();
  add_milliseconds(command, "--handshake-time", serve.handshake_time, 0.1,
                   "Longest time for a request to arrive, and from a WebSocket's start to its Open. Default: 10");
  add_milliseconds(command, "--drain-time", serve.drain_time, 0,
                   "Longest time for clients to disconnect at shutdown; then they are disconnected. Default: 5");
}

void add_access_options(CLI::App& command, ServeOptions& serve, TlsFiles& tls) {
  const auto group = "Access";
  const auto use_tls = [&serve, &tls](std::filesystem::path& path) {
    return [&serve, &tls, &path](const std::string& file) {
      path = file;
      serve.tls = tls;
    };
  };
  const auto certificate =
      command
          .add_option_function<std::string>(
              "--tls-cert", use_tls(tls.certificate),
              "Serve https and wss with this certificate (PEM, followed by its intermediate certificates); reloaded when it changes")
          ->type_name("FILE")
          ->group(group);
  command.add_option_function<std::string>("--tls-key", use_tls(tls.key), "Private key of the certificate (PEM)")
      ->type_name("FILE")
      ->group(group)
      ->needs(certificate);
  certificate->needs("--tls-key");
  command
      .add_option("--tokens", serve.tokens,
                  "File of access tokens: on each line a token, and patterns (with * and ?) of the data sets it grants, if not all; reloaded "
                  "when it changes")
      ->type_name("FILE")
      ->group(group);
  command
      .add_option("--allow-origin", serve.allowed_origins,
                  "Origins of web pages that may open sessions: https://example.org, or * for any; separated by commas in the environment. "
                  "Default: the host of the request")
      ->check([](const std::string& origin) {
        return std::string(may_be_origin(origin) ? "" : "must be like https://example.org:8443, without a path, or *");
      })
      ->type_name("ORIGIN")
      ->group(group);
  command
      .add_option(
          "--connect-origin", serve.connect_origins,
          "Origins, such as https://cdn.example.org, whose files the viewer's page may show (?file=URL); separated by commas in the environment")
      ->check([](const std::string& origin) {
        return std::string(is_connect_origin(origin) ? "" : "must be like https://cdn.example.org or http://127.0.0.1:8000, without a path");
      })
      ->type_name("ORIGIN")
      ->group(group);
  command
      .add_option_function<std::vector<std::string>>(
          "--trusted-proxy",
          [&serve](const std::vector<std::string>& texts) {
            auto proxies = TrustedProxies::parse(texts);
            if (!proxies) throw CLI::ValidationError("--trusted-proxy", proxies.error().message);
            serve.proxies = std::move(*proxies);
          },
          "Addresses and networks of proxies, such as 10.0.0.0/8, whose X-Forwarded-For tells the client's address: the server shares "
          "its time among clients by address; separated by commas in the environment")
      ->type_name("ADDRESS")
      ->group(group);
}

}  // namespace

void add_serve_command(Program& program) {
  const auto options = std::make_shared<ServeCommand>();
  CLI::App& command =
      program.add_command("serve", "Stream interval volumes to clients, until SIGTERM or Ctrl-C", [options] { return run(*options); });
  command.add_option("INPUTS", options->inputs, "Interval volumes (.ivm), folders with them, or their URLs (https://, http://)")
      ->required()
      ->type_name("FILE.ivm|FOLDER|URL ...");
  command.add_option("--listen", options->serve.listen, "Address and port to listen on; IPv6: [::1]:8080; port 0: any free port")
      ->capture_default_str();
  command
      .add_option("--viewer", options->serve.viewer,
                  "Folder of the browser viewer. Default: ../share/intervale/viewer, relative to the program's folder, if it exists")
      ->type_name("FOLDER");
  const auto tolerate_damage = command.add_flag("--tolerate-damage", options->serve.tolerates_damage,
                                                "Serve what is left of files with damaged pages: coarser where pages are missing. "
                                                "Without it they are refused");
  const auto on_demand =
      command.add_flag("--on-demand", options->serve.on_demand,
                       "Read the finer scales of files above 1 MiB only when a view wants them, and drop them when no session uses "
                       "the data set any more. Without it they are read at the start");
  on_demand->excludes(tolerate_damage);
  add_milliseconds(command, "--keep-time", options->serve.keep_time, 0, "With --on-demand: how long unused scales are kept. Default: 600")
      ->needs(on_demand)
      ->group("OPTIONS");
  command.add_option("--threads", options->serve.threads, "Number of threads; 0: one for each core")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  command
      .add_option("--metrics-listen", options->serve.metrics_listen,
                  "Address and port for /metrics, in plain HTTP and without tokens: keep it private")
      ->type_name("ADDRESS:PORT")
      ->group("Logs and metrics");
  add_log_options(command, options->log);
  add_remote_options(command, options->remote);
  add_remote_authorities_option(command, options->remote);
  add_milliseconds(command, "--remote-poll-time", options->remote_poll_time, 0.1,
                   "How often files at URLs are asked whether they have changed. Default: 60")
      ->group(kRemoteGroup);
  add_access_options(command, options->serve, options->tls);
  add_limits(command, *options);
}

}  // namespace intervale
