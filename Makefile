# make docs   the guide and the references of C, C++ and Rust, in target/docs
# make web    the samples as a page, in target/web

docs web:
	$(MAKE) -C $@

.PHONY: docs web
