# make web    the samples as a page, in target/web

web:
	$(MAKE) -C web

.PHONY: web
