/**
 * @file ScanFolder.h
 * @brief The finished parts of a scan in a folder: a scan that was stopped goes on there.
 */
#ifndef DynamicCoronary_ScanFolder_h
#define DynamicCoronary_ScanFolder_h

#include "CtScanner.h"

namespace coronary
{
/// Parts of another scan are removed.
class ScanFolder : public ScanStore
{
public:
  /**
   * @param folder       is made when it does not exist
   * @param description  of all that decides how the parts look
   * @throws std::runtime_error naming `folder` when it can not be made or read
   */
  ScanFolder(const std::string& folder, const std::string& description);

  /// Parts that an earlier run has left.
  int Found() const { return this->Before; }

  bool Has(const std::string& name) const override;
  void Put(const std::string& name, const std::vector<std::int16_t>& part) override;
  std::vector<std::int16_t> Get(const std::string& name) const override;

  /// Removes the folder and all of its parts.
  void Remove();

private:
  std::string PathOf(const std::string& name) const;

  std::string Folder;
  int Before = 0;
};
}

#endif
