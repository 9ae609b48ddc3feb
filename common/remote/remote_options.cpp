#include "common/remote/remote_options.h"

#include <utility>

namespace intervale {
void add_remote_options(CLI::App& app, RemoteOptions& options) {
  app.add_option("--header-file", options.header_file,
                 "File with lines 'Name: value': headers, such as Authorization, that are sent to the host of the URL, and to no other")
      ->type_name("FILE")
      ->group(kRemoteGroup);
  app.add_flag("--aws-sign", options.signs,
               "Sign requests as S3 wants it, with AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and, if set, AWS_SESSION_TOKEN")
      ->group(kRemoteGroup);
  app.add_option("--aws-region", options.aws_region, "Region to sign for, such as eu-west-1")
      ->type_name("REGION")
      ->envname("AWS_REGION")
      ->group(kRemoteGroup);
}

void add_remote_authorities_option(CLI::App& app, RemoteOptions& options) {
  app.add_option("--ca", options.authorities, "With https://: PEM file of certificates to trust instead of the system's")
      ->type_name("FILE")
      ->group(kRemoteGroup);
}

Result<RemoteAccess> read_access(const RemoteOptions& options) {
  RemoteAccess access;
  access.authorities = options.authorities;
  if (options.header_file) {
    auto headers = read_header_file(*options.header_file);
    if (!headers) return tl::unexpected(headers.error());
    access.headers = std::move(*headers);
  }
  if (options.signs) {
    auto aws = aws_from_environment(options.aws_region);
    if (!aws) return tl::unexpected(aws.error());
    access.aws = std::move(*aws);
  }
  return access;
}

}  // namespace intervale
